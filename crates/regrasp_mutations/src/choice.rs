//! Where plans are damaged: random segments, waypoints, fingers and joints. None where there is nothing to choose from.

use regrasp_base::Rng;
use regrasp_plan::check::model::{CheckedHand, DriveRow};
use regrasp_plan::plan::{Plan, Segment, SegmentKind, Waypoint};

/// A random one of `items`.
pub(super) fn pick<'a, T>(items: &'a mut [T], rng: &mut Rng) -> Option<&'a mut T> {
    if items.is_empty() { None } else { Some(&mut items[rng.below(items.len())]) }
}

/// All waypoints, of all segments in order.
pub(super) fn waypoints(plan: &Plan) -> impl Iterator<Item = &Waypoint> {
    plan.segments.iter().flat_map(|segment| &segment.waypoints)
}

/// As [`waypoints`], to be changed.
pub(super) fn waypoints_mut(plan: &mut Plan) -> impl Iterator<Item = &mut Waypoint> {
    plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints)
}

/// A random waypoint of a random segment.
pub(super) fn any_waypoint<'a>(plan: &'a mut Plan, rng: &mut Rng) -> Option<&'a mut Waypoint> {
    pick(&mut pick(&mut plan.segments, rng)?.waypoints, rng)
}

/// A random segment of `kind`.
pub(super) fn any_segment<'a>(plan: &'a mut Plan, rng: &mut Rng, kind: SegmentKind) -> Option<&'a mut Segment> {
    let mut segments: Vec<_> = plan.segments.iter_mut().filter(|segment| segment.kind == kind).collect();
    (!segments.is_empty()).then(|| segments.swap_remove(rng.below(segments.len())))
}

/// A random segment in which closure is judged.
pub(super) fn any_closed<'a>(plan: &'a mut Plan, rng: &mut Rng) -> Option<&'a mut Segment> {
    let mut segments: Vec<_> =
        plan.segments.iter_mut().filter(|segment| segment.kind != SegmentKind::Tracking).collect();
    (!segments.is_empty()).then(|| segments.swap_remove(rng.below(segments.len())))
}

/// A random joint that has a drive of its own, of those that fit.
pub(super) fn any_drive<'a>(
    model: &'a CheckedHand,
    rng: &mut Rng,
    fits: impl Fn(&DriveRow) -> bool,
) -> Option<&'a DriveRow> {
    let drives: Vec<_> = model.drives.iter().filter(|drive| !drive.follows && fits(drive)).collect();
    drives.get(rng.below(drives.len().max(1))).copied()
}

/// Segments, and fingers in them, that fit.
pub(super) fn places(plan: &Plan, model: &CheckedHand, fits: impl Fn(&Segment, usize) -> bool) -> Vec<(usize, usize)> {
    (0..plan.segments.len())
        .flat_map(|s| (0..model.fingers.len()).map(move |f| (s, f)))
        .filter(|&(s, f)| fits(&plan.segments[s], f))
        .collect()
}

/// Swaps two of `items`.
pub(super) fn swap_two<T: PartialEq>(items: &mut [T], rng: &mut Rng) -> Option<()> {
    let n_items = items.len();
    (n_items >= 2).then(|| {
        let first = rng.below(n_items);
        items.swap(first, (first + 1 + rng.below(n_items - 1)) % n_items);
    })
}

/// Swaps two items of which `differ` says that it matters.
pub(super) fn swap_two_that<T>(items: &mut [T], rng: &mut Rng, differ: impl Fn(&T, &T) -> bool) -> Option<()> {
    let pairs: Vec<(usize, usize)> = (0..items.len())
        .flat_map(|i| (i + 1..items.len()).map(move |k| (i, k)))
        .filter(|&(i, k)| differ(&items[i], &items[k]))
        .collect();
    let &(i, k) = pairs.get(rng.below(pairs.len().max(1)))?;
    items.swap(i, k);
    Some(())
}

/// A random inner waypoint of a random segment of `kind`.
pub(super) fn pick_waypoint(plan: &Plan, rng: &mut Rng, kind: SegmentKind) -> Option<(usize, usize)> {
    let places: Vec<(usize, usize)> = plan
        .segments
        .iter()
        .enumerate()
        .filter(|(_, segment)| segment.kind == kind)
        .flat_map(|(s, segment)| (1..segment.waypoints.len() - 1).map(move |w| (s, w)))
        .collect();
    if places.is_empty() { None } else { Some(places[rng.below(places.len())]) }
}
