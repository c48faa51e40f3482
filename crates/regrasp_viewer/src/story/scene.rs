//! Links, joints, fingers and what they look like.

use super::pack::pack;
use super::simplify::simplify;
use super::tessellate::{Triangles, tessellate};
use super::{
    Carrier, FingerStory, JointStory, LeaderStory, LinkKind, LinkStory, OtherCarrier, PieceStory, PoseData, Role,
    SceneStory,
};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape, UnitVector, Vector};
use regrasp_robot::hand::convex_of;
use regrasp_robot::tip::is_same_surface;
use regrasp_robot::{Coupling, Hand, Joint, JointId, JointKind, LinkId, ResolveOptions, Robot, VisualGeometry};
use regrasp_scene::Manipulation;
use std::sync::Arc;

/// Most triangles in a page, each mesh counted once: less than 3 MB of text.
const MOST_TRIANGLES: usize = 120_000;

/// The scene, with remarks on what could not be shown as it is. Visual meshes are looked for in `packages`.
pub(super) fn scene_story(task: &Manipulation, packages: &ResolveOptions) -> (SceneStory, Vec<(String, String)>) {
    let hand = task.hand();
    let tree = Tree::new(hand);
    let mut shapes = Shapes::default();
    let mut pieces = collision_pieces(task, &tree, &mut shapes);
    let (visual, mut notes) = visual_pieces(hand, &tree, &pieces, packages, &mut shapes);
    pieces.extend(visual);
    let names = hand.joint_names();
    let effort_of = |name: &str| hand.robot.joint_named(name).and_then(|id| hand.robot.joints[id.0].limits?.effort);
    let chains = hand.fingers.iter().map(|finger| &finger.chain);
    let limits = chains.flat_map(|chain| chain.lower.iter().copied().zip(chain.upper.iter().copied()));
    let finite = |value: f64| value.is_finite().then_some(value);
    let joint = |(name, (lower, upper)): (&String, (f64, f64))| JointStory {
        name: name.clone(),
        lower: finite(lower),
        upper: finite(upper),
        effort: effort_of(name),
    };
    let joints = names.iter().zip(limits).map(joint).collect();
    let meshes = shapes.packed(&mut notes);
    let mut story = SceneStory {
        links: tree.links.clone(),
        world_from_root: PoseData::from(&Pose::identity()),
        joints,
        fingers: fingers(hand, &tree),
        friction: task.object().friction,
        gravity_in_world: task.scene.gravity().in_world().map(Into::into),
        meshes,
        pieces,
    };
    // No coordinate of the hand moves its base.
    let root_from_base = story.world_from_links(&vec![0.0; names.len()])[tree.place_of[hand.base.0]];
    story.world_from_root = PoseData::from(&(task.world_from_hand() * root_from_base.inverse()));
    (story, notes)
}

fn fingers(hand: &Hand, tree: &Tree) -> Vec<FingerStory> {
    let story = |finger: &regrasp_robot::Finger| {
        let link = finger.tip.link;
        let center = hand.robot.fixed_pose_in_body(link).inverse() * finger.tip.center_in_body;
        FingerStory {
            name: finger.name.clone(),
            tip_link: tree.place_of[link.0],
            tip_center_in_link: center.coords.into(),
            tip_radius: finger.tip.radius(),
        }
    };
    hand.fingers.iter().map(story).collect()
}

/// Links in an order in which parents come first.
struct Tree {
    links: Vec<LinkStory>,
    /// The robot's link of each.
    ids: Vec<LinkId>,
    /// By the robot's link: where it is in `links`.
    place_of: Vec<usize>,
}

impl Tree {
    fn new(hand: &Hand) -> Self {
        let robot: &Robot = &hand.robot;
        let names = hand.joint_names();
        let finger_of: Vec<i32> = (0i32..)
            .zip(&hand.fingers)
            .flat_map(|(f, finger)| std::iter::repeat_n(f, finger.chain.n_coordinates()))
            .collect();
        let root = LinkStory {
            name: robot.links[robot.root.0].name.clone(),
            parent: -1,
            kind: LinkKind::Fixed,
            parent_from_joint: PoseData::from(&Pose::identity()),
            axis: [0.0, 0.0, 1.0],
            joint: -1,
            multiplier: 0.0,
            offset: 0.0,
            others: Vec::new(),
            finger: -1,
        };
        let mut tree = Tree { links: vec![root], ids: vec![robot.root], place_of: vec![0; robot.links.len()] };
        let mut next = 0;
        while next < tree.ids.len() {
            for id in robot.joints_from(tree.ids[next]) {
                let joint = &robot.joints[id.0];
                let drive = joint.coupling.clone().unwrap_or_else(|| Coupling::independent(id));
                let held = |leader: JointId| {
                    let limits = robot.joints[leader.0].limits;
                    limits.map_or(0.0, |limits| 0f64.max(limits.lower).min(limits.upper))
                };
                let (mut driven, mut offset) = (Vec::new(), drive.offset);
                for &(leader, multiplier) in drive.terms.iter().filter(|_| joint.kind != JointKind::Fixed) {
                    match names.iter().position(|name| *name == robot.joints[leader.0].name) {
                        Some(joint) => driven.push(LeaderStory { joint, multiplier }),
                        None if drive.terms.len() > 1 => offset += multiplier * held(leader),
                        None => {}
                    }
                }
                let coordinate = driven.first().map(|first| first.joint);
                let mut link = carried_link(joint, &driven, offset, drive.position(held));
                link.name.clone_from(&robot.links[joint.child.0].name);
                link.parent = next as i32;
                link.finger = match tree.links[next].finger {
                    -1 => coordinate.map_or(-1, |k| finger_of[k]),
                    of_parent => of_parent,
                };
                tree.place_of[joint.child.0] = tree.ids.len();
                tree.ids.push(joint.child);
                tree.links.push(link);
            }
            next += 1;
        }
        tree
    }
}

/// The link that `joint` carries, without name, parent and finger; fixed at `held` where no coordinate drives the joint.
fn carried_link(joint: &Joint, driven: &[LeaderStory], offset: f64, held: f64) -> LinkStory {
    let slides = joint.kind == JointKind::Prismatic;
    let first = driven.first();
    let (kind, at_zero) = match (first, joint.kind) {
        (Some(_), _) if slides => (LinkKind::Prismatic, joint.parent_from_joint),
        (Some(_), _) => (LinkKind::Revolute, joint.parent_from_joint),
        (None, JointKind::Fixed) => (LinkKind::Fixed, joint.parent_from_joint),
        (None, _) => (LinkKind::Fixed, joint.parent_from_joint * motion(&joint.axis, slides, held)),
    };
    LinkStory {
        name: String::new(),
        parent: -1,
        kind,
        parent_from_joint: PoseData::from(&at_zero),
        axis: joint.axis.into_inner().into(),
        joint: first.map_or(-1, |first| first.joint as i32),
        multiplier: first.map_or(0.0, |first| first.multiplier),
        offset: first.map_or(0.0, |_| offset),
        others: driven.iter().skip(1).copied().collect(),
        finger: -1,
    }
}

/// Pose of the child frame in the joint frame at `position`.
fn motion(axis: &UnitVector, slides: bool, position: f64) -> Pose {
    let along = axis.into_inner() * position;
    if slides { Pose::new(along, Vector::zeros()) } else { Pose::new(Vector::zeros(), along) }
}

impl SceneStory {
    /// Poses of all links in the world at `joints`, one value per entry of [`SceneStory::joints`].
    pub fn world_from_links(&self, joints: &[f64]) -> Vec<Pose> {
        let mut poses: Vec<Pose> = Vec::with_capacity(self.links.len());
        for link in &self.links {
            let parent = usize::try_from(link.parent).map_or(Pose::from(&self.world_from_root), |k| poses[k]);
            let others: f64 = link.others.iter().map(|other| other.multiplier * joints[other.joint]).sum();
            let position =
                usize::try_from(link.joint).map_or(0.0, |k| link.multiplier * joints[k] + others + link.offset);
            let axis = UnitVector::new_unchecked(Vector::from(link.axis));
            let moved = motion(&axis, link.kind == LinkKind::Prismatic, position);
            poses.push(parent * Pose::from(&link.parent_from_joint) * moved);
        }
        poses
    }
}

/// What planner and checker keep apart: meshes of links as their hulls, and the balls of fingertips.
fn collision_pieces(task: &Manipulation, tree: &Tree, shapes: &mut Shapes) -> Vec<PieceStory> {
    let hand = task.hand();
    let mut pieces = Vec::new();
    for (place, id) in tree.ids.iter().enumerate() {
        let link = &hand.robot.links[id.0];
        let tip = hand.fingers.iter().find(|finger| finger.tip.link == *id);
        let mut add = |from_mesh: &Pose, mesh: usize| {
            pieces.push(PieceStory {
                on: Carrier::Link(place),
                name: link.name.clone(),
                role: Role::Collision,
                mesh,
                from_mesh: PoseData::from(from_mesh),
                is_tip: tip.is_some(),
            });
        };
        for placed in &link.collision {
            let mesh = shapes.hull_of(&placed.shape);
            add(&placed.parent_from_shape, mesh);
        }
        if let Some(own) = tip.and_then(|finger| finger.tip.own_shape()) {
            let link_from_body = hand.robot.fixed_pose_in_body(*id).inverse();
            let own = PlacedShape { parent_from_shape: link_from_body * own.parent_from_shape, shape: own.shape };
            if !link.collision.iter().any(|placed| is_same_surface(placed, &own)) {
                add(&own.parent_from_shape, shapes.index_of(&own.shape));
            }
        }
    }
    let mut add = |on, name: &str, from_mesh: &Pose, shape: &Shape| {
        let (on, mesh) = (Carrier::Other(on), shapes.index_of(shape));
        let (name, from_mesh) = (name.to_owned(), PoseData::from(from_mesh));
        pieces.push(PieceStory { on, name, role: Role::Collision, mesh, from_mesh, is_tip: false });
    };
    add(OtherCarrier::Object, &task.object().name, &Pose::identity(), &task.object().shape);
    for obstacle in task.scene.obstacles.iter().chain(&task.bystanders()) {
        add(OtherCarrier::World, &obstacle.name, &obstacle.placed.parent_from_shape, &obstacle.placed.shape);
    }
    pieces
}

/// What the hand looks like, with the pieces of `collision` where nothing is known; none when the robot has no visuals.
/// And remarks on what could not be read.
fn visual_pieces(
    hand: &Hand,
    tree: &Tree,
    collision: &[PieceStory],
    packages: &ResolveOptions,
    shapes: &mut Shapes,
) -> (Vec<PieceStory>, Vec<(String, String)>) {
    let mut pieces = Vec::new();
    let mut notes = Vec::new();
    let mut has_visuals = false;
    for (place, id) in tree.ids.iter().enumerate() {
        let link = &hand.robot.links[id.0];
        let is_tip = hand.fingers.iter().any(|finger| finger.tip.link == *id);
        let found: Result<Vec<(Pose, usize)>, String> = link
            .visual
            .iter()
            .map(|visual| Ok((visual.parent_from_visual, shapes.visual(&visual.geometry, packages)?)))
            .collect();
        match found {
            Ok(found) if !found.is_empty() => {
                has_visuals = true;
                pieces.extend(found.into_iter().map(|(from_mesh, mesh)| PieceStory {
                    on: Carrier::Link(place),
                    name: link.name.clone(),
                    role: Role::Visual,
                    mesh,
                    from_mesh: PoseData::from(&from_mesh),
                    is_tip,
                }));
            }
            found => {
                if let Err(problem) = found {
                    notes.push((format!("Looks of {}", link.name), format!("collision geometry: {problem}")));
                }
                let on_link = collision.iter().filter(|piece| piece.on == Carrier::Link(place));
                pieces.extend(on_link.map(|piece| PieceStory { role: Role::Visual, ..piece.clone() }));
            }
        }
    }
    if !has_visuals {
        return (Vec::new(), notes);
    }
    let others = collision.iter().filter(|piece| matches!(piece.on, Carrier::Other(_)));
    pieces.extend(others.map(|piece| PieceStory { role: Role::Visual, ..piece.clone() }));
    (pieces, notes)
}

/// Shapes, each once.
#[derive(Default)]
struct Shapes {
    shapes: Vec<Shape>,
    /// Shapes of links and the index of the hull of each.
    hulls: Vec<(Shape, usize)>,
}

impl Shapes {
    fn index_of(&mut self, shape: &Shape) -> usize {
        self.shapes.iter().position(|known| known == shape).unwrap_or_else(|| {
            self.shapes.push(shape.clone());
            self.shapes.len() - 1
        })
    }

    /// The convex shape that stands for `shape` in the hand.
    fn hull_of(&mut self, shape: &Shape) -> usize {
        if let Some((_, index)) = self.hulls.iter().find(|(known, _)| known == shape) {
            return *index;
        }
        // A mesh without a hull is refused when a hand is loaded; links that belong to no hand may have one.
        let hull = convex_of(shape).unwrap_or_else(|_| shape.clone());
        let index = self.index_of(&hull);
        self.hulls.push((shape.clone(), index));
        index
    }

    fn visual(&mut self, geometry: &VisualGeometry, packages: &ResolveOptions) -> Result<usize, String> {
        let shape = match geometry {
            VisualGeometry::Shape(shape) => shape.clone(),
            VisualGeometry::Unreadable(problem) => return Err(problem.clone()),
            VisualGeometry::Mesh(mesh) => {
                let read = mesh.load(packages).map_err(|error| {
                    let problem = error.diagnostics.first().map_or_else(String::new, |first| first.problem.clone());
                    format!("{}: {problem}", mesh.name)
                });
                Shape::Mesh(Arc::new(read?))
            }
        };
        Ok(self.index_of(&shape))
    }

    /// All of them as packed meshes of no more than [`MOST_TRIANGLES`] in all; a remark when some have fewer than they had.
    fn packed(&self, notes: &mut Vec<(String, String)>) -> Vec<super::MeshStory> {
        let drawn: Vec<Triangles> = self.shapes.iter().map(tessellate).collect();
        let sizes: Vec<usize> = drawn.iter().map(|triangles| triangles.triangles.len()).collect();
        let most = most_each(&sizes, MOST_TRIANGLES);
        let n_cut = sizes.iter().filter(|&&size| size > most).count();
        if n_cut > 0 {
            let total: usize = sizes.iter().sum();
            let value = format!("{n_cut} of {} drawn with at most {most} triangles; {total} in the files", sizes.len());
            notes.push(("Meshes".into(), value));
        }
        let packed = |triangles| {
            let Triangles { vertices, triangles, smooth_below } = simplify(triangles, most);
            pack(&vertices, &triangles, smooth_below)
        };
        drawn.into_iter().map(packed).collect()
    }
}

/// The largest size that every mesh may have so that all together have at most `total`.
fn most_each(sizes: &[usize], total: usize) -> usize {
    let mut sorted = sizes.to_vec();
    sorted.sort_unstable();
    let mut left = total;
    for (i, &size) in sorted.iter().enumerate() {
        let each = left / (sorted.len() - i);
        if size > each {
            return each;
        }
        left -= size;
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_meshes_are_cut_first() {
        assert_eq!(most_each(&[], 10), 10);
        assert_eq!(most_each(&[3, 4], 10), 10);
        assert_eq!(most_each(&[3, 40], 10), 7);
        assert_eq!(most_each(&[3, 40, 50], 11), 4);
    }
}
