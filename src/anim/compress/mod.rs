//! wip
pub mod coder; pub mod container; pub mod faces; pub mod field; pub mod hierarchy; pub mod integers; pub mod mixing; pub mod prediction; pub mod spectrum; pub mod trajectory;
