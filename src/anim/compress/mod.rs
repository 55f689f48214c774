//! wip
pub mod coder; pub mod container; pub mod faces; pub mod field; pub mod hierarchy; pub mod integers; pub mod local; pub mod mixing; pub mod prediction; pub mod spectrum; pub mod trajectory;
