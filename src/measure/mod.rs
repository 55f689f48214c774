//! Judging results: errors between two things of one kind.
