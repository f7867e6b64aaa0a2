//! Progress bars, on stderr and only where a person watches.

use crate::progress::{Progress, Silent};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, stderr};
use std::sync::{PoisonError, RwLock};

/// A bar per stage if stderr is a terminal, silence otherwise.
pub(super) fn for_terminal() -> Box<dyn Progress> {
    if stderr().is_terminal() {
        Box::new(Bars(RwLock::new(ProgressBar::hidden())))
    } else {
        Box::new(Silent)
    }
}

/// The bar of the current stage; it vanishes with the stage.
struct Bars(RwLock<ProgressBar>);

impl Progress for Bars {
    fn stage(&self, name: &'static str, steps: u64) {
        let bar = ProgressBar::new(steps).with_message(name);
        if let Ok(style) = ProgressStyle::with_template("{msg:10} {wide_bar} {pos}/{len}") {
            bar.set_style(style);
        }
        let mut current = self.0.write().unwrap_or_else(PoisonError::into_inner);
        std::mem::replace(&mut *current, bar).finish_and_clear();
    }

    fn advance(&self, steps: u64) {
        self.0
            .read()
            .unwrap_or_else(PoisonError::into_inner)
            .inc(steps);
    }
}

impl Drop for Bars {
    fn drop(&mut self) {
        self.0
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner)
            .finish_and_clear();
    }
}
