//! How an algorithm says how far it is, without knowing who listens.

/// Hears which stage runs and how much of it is done.
pub trait Progress: Sync {
    /// A stage begins; it will take `units` steps (0 where that is not known). The one before ends.
    fn stage(&self, name: &'static str, units: u64);

    /// `units` more steps of the current stage are done. May be called from any thread.
    fn advance(&self, units: u64);
}

/// A listener that does not care.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn stage(&self, _name: &'static str, _units: u64) {}
    fn advance(&self, _units: u64) {}
}
