//! How long work tells its caller how far it is. The library prints nothing itself.

/// Receives the stages of an import or a bake, from any thread.
pub trait Progress: Sync {
    /// A stage begins; `steps` of [`Progress::advance`] complete it, 0 where that is not known.
    fn stage(&self, name: &'static str, steps: u64);
    /// `steps` more of the current stage are done.
    fn advance(&self, steps: u64);
}

/// Reports to nobody.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn stage(&self, _: &'static str, _: u64) {}
    fn advance(&self, _: u64) {}
}
