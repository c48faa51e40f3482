//! Broken lists are rejected, every one, for the right reason. `REGRASP_MUTANTS` says how many of each kind.

use crate::sample::{bundled, check, list, settings};
use regrasp_base::Rng;
use regrasp_mutations::grasps::{KINDS, mutant};

#[test]
fn every_mutant_is_rejected() {
    let wanted: usize = std::env::var("REGRASP_MUTANTS").ok().and_then(|n| n.parse().ok()).unwrap_or(8);
    let scene = bundled("wide_four_finger", "box_90x.toml");
    let list = list(&scene, &settings(wanted.clamp(10, 60)), 3).unwrap();
    for name in KINDS {
        let (mut n_made, mut n_asked) = (0, 0u64);
        while n_made < wanted {
            assert!(n_asked < 100 * wanted as u64, "{name}: {n_made} mutants of {n_asked} trials");
            let mut rng = Rng::keyed(9, name, n_asked);
            let index = rng.below(list.grasps.len());
            n_asked += 1;
            let Some(mutant) = mutant(&scene, &list, index, name, &mut rng) else { continue };
            n_made += 1;
            let report = check(&scene, &mutant.list);
            let seen: Vec<_> = report.violations.iter().map(|violation| violation.kind).collect();
            assert!(
                seen.iter().any(|kind| mutant.expected.contains(kind)),
                "{name} of grasp {index}: expected {:?}, seen {seen:?}",
                mutant.expected
            );
        }
    }
}
