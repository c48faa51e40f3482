//! Broken lists are rejected, every one, for the right reason. `REGRASP_MUTANTS` says how many of each kind.

use crate::sample::{check, list, settings, with_lamp};
use regrasp_base::Rng;
use regrasp_grasp::list::format::{from_json, to_json};
use regrasp_mutations::grasps::{KINDS, mutant};
use regrasp_plan::check::ViolationKind;
use std::path::Path;

#[test]
fn every_mutant_is_rejected() {
    let wanted: usize = std::env::var("REGRASP_MUTANTS").ok().and_then(|n| n.parse().ok()).unwrap_or(8);
    let scene = with_lamp("box_90x.toml", 0.3);
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

/// A joint of no finger stands where the hand file says: the list names it, and is good for no hand that has it elsewhere.
#[test]
fn a_joint_of_no_finger_is_named() {
    let scene = with_lamp("box_90x.toml", -0.45);
    let list = list(&scene, &settings(6), 3).unwrap();
    assert_eq!(
        list.hand.held_joints.iter().map(|(name, at)| (name.as_str(), *at)).collect::<Vec<_>>(),
        [("lamp", -0.45)]
    );
    let read = from_json(Path::new("grasps.json"), to_json(&list).as_bytes()).unwrap();
    assert_eq!(read, list);
    assert!(check(&scene, &read).accepted());
    let elsewhere = check(&with_lamp("box_90x.toml", -0.44), &list);
    let told = elsewhere.violations.iter().find(|violation| violation.kind == ViolationKind::WrongScene).unwrap();
    assert!(told.message.contains("lamp") && told.message.contains("-0.45") && told.message.contains("-0.44"));
}
