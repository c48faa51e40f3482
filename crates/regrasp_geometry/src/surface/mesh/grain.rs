//! How long the creases of a mesh run on: along its size where they are edges of the object, a few millimetres where they are the
//! texture of a scan.

use crate::frame::Point;
use std::collections::BTreeMap;

/// Two creases that meet alone run on into each other where they turn by at most 30 degrees.
const COS_RUNS_ON: f64 = 0.866;

/// Length of the runs of `creases`, in metres: their mean, weighed by length. None without creases.
pub(super) fn grain(creases: &[[Point; 2]]) -> Option<f64> {
    let key = |p: &Point| [p.x, p.y, p.z].map(f64::to_bits);
    let mut meeting: BTreeMap<[u64; 3], Vec<(usize, usize)>> = BTreeMap::new();
    for (index, crease) in creases.iter().enumerate() {
        (0..2).for_each(|end| meeting.entry(key(&crease[end])).or_default().push((index, end)));
    }
    // Each crease leads towards the lowest of its run.
    let mut towards: Vec<usize> = (0..creases.len()).collect();
    for ends in meeting.values() {
        let &[(a, at_a), (b, at_b)] = &ends[..] else { continue };
        let away = |index: usize, end: usize| (creases[index][1 - end] - creases[index][end]).normalize();
        if -away(a, at_a).dot(&away(b, at_b)) >= COS_RUNS_ON {
            let (a, b) = (lowest(&mut towards, a), lowest(&mut towards, b));
            towards[a.max(b)] = a.min(b);
        }
    }
    let mut lengths = vec![0.0; creases.len()];
    for (index, [from, to]) in creases.iter().enumerate() {
        lengths[lowest(&mut towards, index)] += (to - from).norm();
    }
    let (sum, squares) = lengths.iter().fold((0.0, 0.0), |(sum, squares), x| (sum + x, squares + x * x));
    (sum > 0.0).then(|| squares / sum)
}

fn lowest(towards: &mut [usize], mut index: usize) -> usize {
    while towards[index] != index {
        towards[index] = towards[towards[index]];
        index = towards[index];
    }
    index
}
