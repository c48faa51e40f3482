//! Which links of a whole robot touch over random postures.

use super::super::{PairRow, PairTable};
use crate::hand::convex_of;
use crate::manipulator::{Manipulator, NoPosture, Parts};
use crate::robot::{LinkId, Robot};
use regrasp_base::Rng;
use regrasp_geometry::collision::{Placed, Placement, Separation, separation};
use regrasp_geometry::{Point, Pose, Shape, TriangleMesh, Vector};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::Arc;

/// A collision shape of a link with its bounding ball.
struct LinkBody {
    link: LinkId,
    link_from_shape: Pose,
    shape: Shape,
    center: Point,
    radius: f64,
}

/// All pairs of links that are not neighbours and not in `allowed`, counted over `n_postures` random postures, and at rest.
///
/// Errors: limits of joints that leave no posture.
pub(super) fn count(
    robot: &Arc<Robot>,
    allowed: &BTreeSet<(LinkId, LinkId)>,
    n_postures: usize,
    rng: &mut Rng,
) -> Result<PairTable, NoPosture> {
    let parts = Parts { allow: allowed.clone(), ..Parts::default() };
    let manipulator = Manipulator::new(robot.name.clone(), robot.clone(), parts)?;
    let bodies = bodies(robot);
    let of_link = |link: usize| -> Vec<usize> { (0..bodies.len()).filter(|&k| bodies[k].link.0 == link).collect() };
    let by_link: Vec<Vec<usize>> = (0..robot.links.len()).map(of_link).collect();
    let mut pairs = Vec::new();
    for a in (0..by_link.len()).filter(|&a| !by_link[a].is_empty()) {
        let others = (a + 1..by_link.len()).filter(|&b| !by_link[b].is_empty());
        pairs.extend(others.map(|b| (LinkId(a), LinkId(b))).filter(|&(a, b)| !manipulator.may_touch(a, b)));
    }
    let mut counts = vec![0usize; pairs.len()];
    let (mut poses, mut placed) = (Vec::new(), Vec::new());
    let mut touching = |state: &[f64], add: &mut dyn FnMut(usize)| {
        manipulator.link_poses(state, &mut poses);
        placed.clear();
        placed.extend(bodies.iter().map(|body| {
            let pose = poses[body.link.0] * body.link_from_shape;
            let rotation = pose.rotation.to_rotation_matrix().into_inner();
            (Placement { rotation, translation: pose.translation.vector }, pose * body.center)
        }));
        for (k, (a, b)) in pairs.iter().enumerate() {
            let touches = |i: usize, j: usize| {
                let (first, second): (&(Placement, Point), &(Placement, Point)) = (&placed[i], &placed[j]);
                if (first.1 - second.1).norm() > bodies[i].radius + bodies[j].radius {
                    return false;
                }
                let (mut direction, mut hints) = (Vector::zeros(), [0, 0]);
                let first = Placed { shape: &bodies[i].shape, at: &first.0 };
                let second = Placed { shape: &bodies[j].shape, at: &second.0 };
                let answer = separation(first, second, 0.0, 0.0, &mut direction, &mut hints);
                !matches!(answer, Separation::SeparatedBy(_))
            };
            if by_link[a.0].iter().any(|&i| by_link[b.0].iter().any(|&j| touches(i, j))) {
                add(k);
            }
        }
    };
    for _ in 0..n_postures {
        let state = draw(&manipulator, rng);
        touching(&state, &mut |k| counts[k] += 1);
    }
    let mut at_rest = Vec::new();
    touching(&manipulator.layout.rest(), &mut |k| at_rest.push(k));
    let names = |k: usize| [pairs[k].0, pairs[k].1].map(|link| robot.links[link.0].name.clone());
    let mut table = PairTable {
        n_postures,
        always: Vec::new(),
        sometimes: Vec::new(),
        never: Vec::new(),
        at_rest: at_rest.into_iter().map(names).collect(),
        always_ids: BTreeSet::new(),
    };
    for (k, &count) in counts.iter().enumerate() {
        match count {
            0 => table.never.push(names(k)),
            n if n == n_postures => {
                table.always.push(names(k));
                table.always_ids.insert(pairs[k]);
            }
            n => table.sometimes.push(PairRow { links: names(k), share: n as f64 / n_postures as f64 }),
        }
    }
    Ok(table)
}

/// A posture, uniform in the limits and brought within those of sums.
fn draw(manipulator: &Manipulator, rng: &mut Rng) -> Vec<f64> {
    let finite = |end: f64| if end.is_finite() { end } else { PI.copysign(end) };
    let [lower, upper] = manipulator.layout.limits();
    let drawn: Vec<f64> = lower.iter().zip(&upper).map(|(&l, &u)| rng.uniform(finite(l), finite(u))).collect();
    match manipulator.layout.linear_limits.as_slice() {
        [] => drawn,
        limits => crate::coupling::bring_within(limits, [&lower, &upper], &drawn).unwrap_or(drawn),
    }
}

/// Convex shapes of all links. A mesh without an inside is left out: reading the robot file refuses it.
fn bodies(robot: &Robot) -> Vec<LinkBody> {
    let mut made: Vec<(Arc<TriangleMesh>, Option<Shape>)> = Vec::new();
    let mut bodies = Vec::new();
    for (index, link) in robot.links.iter().enumerate() {
        for placed in &link.collision {
            let shape = match &placed.shape {
                Shape::Mesh(mesh) => match made.iter().find(|(known, _)| Arc::ptr_eq(known, mesh)) {
                    Some((_, hull)) => hull.clone(),
                    None => {
                        let hull = convex_of(&placed.shape).ok();
                        made.push((mesh.clone(), hull.clone()));
                        hull
                    }
                },
                shape => Some(shape.clone()),
            };
            if let Some(shape) = shape {
                let (center, radius) = shape.bounding_sphere();
                let link_from_shape = placed.parent_from_shape;
                bodies.push(LinkBody { link: LinkId(index), link_from_shape, shape, center, radius });
            }
        }
    }
    bodies
}
