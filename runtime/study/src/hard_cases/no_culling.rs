//! What no culling of a case says about `hroc_keeps`; see [`crate::unculled`].

use hroc_runtime::DepthConvention;
use serde::{Deserialize, Serialize};

use super::run::CaseResult;
use crate::table;
use crate::unculled::{Fault, Judgement, Removed};

/// The judgements of a case's frames, summed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct CaseNoCulling {
    /// `standard` or `reversed`.
    pub depth: String,
    /// Pixels, summed over frames, as the next two.
    pub removed: Removed,
    pub strays: usize,
    pub kept_strays: usize,
    /// The first fault of each frame that has one.
    pub faults: Vec<CaseFault>,
}

/// A fragment that `hroc_keeps` judged wrongly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct CaseFault {
    pub frame: usize,
    pub size: [u32; 2],
    #[serde(flatten)]
    pub fault: Fault,
}

impl CaseNoCulling {
    pub(super) fn new(depth: DepthConvention) -> Self {
        Self {
            depth: depth.name().to_owned(),
            removed: Removed::default(),
            strays: 0,
            kept_strays: 0,
            faults: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, frame: usize, size: [u32; 2], judgement: &Judgement) {
        self.removed += judgement.removed;
        self.strays += judgement.strays;
        self.kept_strays += judgement.kept_strays;
        let fault = judgement.first_fault;
        self.faults
            .extend(fault.map(|fault| CaseFault { frame, size, fault }));
    }
}

/// A table of the cases in which anything was removed or strayed; empty where there is none.
pub(super) fn table(cases: &[CaseResult]) -> String {
    let judged = cases
        .iter()
        .flat_map(|case| case.no_culling.iter().map(move |judged| (case, judged)));
    let rows = judged
        .filter(|(_, judged)| judged.removed.all() + judged.strays + judged.kept_strays > 0)
        .map(|(case, judged)| {
            let removed = judged.removed;
            let pixels = [
                removed.stray,
                removed.not_finite,
                removed.true_,
                judged.strays,
                judged.kept_strays,
            ];
            let [stray, not_finite, true_, strays, kept] = pixels.map(|n| n.to_string());
            let (case, depth) = (case.case.clone(), judged.depth.clone());
            [case, depth, stray, not_finite, true_, strays, kept]
        })
        .collect::<Vec<_>>();
    if rows.is_empty() {
        return String::new();
    }
    let head = [
        "no culling, pixels",
        "depth",
        "removed strays",
        "removed, not finite",
        "removed, true",
        "strays",
        "strays kept",
    ];
    "\n".to_owned() + &table::markdown(head, rows)
}
