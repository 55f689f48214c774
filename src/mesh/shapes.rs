//! Shapes made by formula, for fixtures, tests and benches.
