//! Pipelines that were made on a device, so that a second view, or a second scene, need not compile them again.

use std::any::Any;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

type Made = HashMap<String, Arc<dyn Any + Send + Sync>>;

/// The pipelines of one device. Clones share them.
#[derive(Clone, Default)]
pub struct Pipelines(Arc<Mutex<Made>>);

impl Pipelines {
    /// What `make` made the first time that `key` was asked for. The key tells all that the thing depends on.
    /// `make` must not ask for another: nobody else can until it returns.
    pub fn get<T: Clone + Send + Sync + 'static>(&self, key: &str, make: impl FnOnce() -> T) -> T {
        let mut made = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        find(&made, key).unwrap_or_else(|| {
            let thing = make();
            made.insert(key.to_owned(), Arc::new(thing.clone()));
            thing
        })
    }

    /// What was made for `key`, if anything was.
    pub fn find<T: Clone + 'static>(&self, key: &str) -> Option<T> {
        let made = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        find(&made, key)
    }
}

fn find<T: Clone + 'static>(made: &Made, key: &str) -> Option<T> {
    made.get(key)?.downcast_ref::<T>().cloned()
}

impl std::fmt::Debug for Pipelines {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let made = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        f.debug_set().entries(made.keys()).finish()
    }
}
