//! Shapes of bodies at their places: what collides, and what it looks like.

use super::links::Tree;
use super::shapes::Shapes;
use super::{Carrier, PieceStory, PoseData, Role};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Pose, Shape};
use regrasp_robot::tip::is_same_surface;
use regrasp_robot::{Finger, LinkId, ResolveOptions, Robot};

/// The pieces of a scene while they are gathered.
pub(super) struct Pieces<'a> {
    packages: &'a ResolveOptions,
    shapes: Shapes,
    collision: Vec<PieceStory>,
    /// What bodies look like; where nothing is known, pieces that collide.
    looks: Vec<PieceStory>,
    /// True where a robot says how anything looks.
    are_looks_known: bool,
    /// Remarks on what could not be shown as it is.
    pub(super) notes: Vec<(String, String)>,
}

/// The links of a body that are drawn.
pub(super) struct DrawnLinks<'a> {
    pub robot: &'a Robot,
    /// Fingers whose tips are among the links.
    pub fingers: &'a [Finger],
    pub tree: &'a Tree,
    /// False for links that another body draws.
    pub own: &'a dyn Fn(LinkId) -> bool,
    /// What carries the pieces of the link at a place of the tree.
    pub on: &'a dyn Fn(usize) -> Carrier,
    /// What is said of the body after the name of a link.
    pub of_body: &'a str,
}

impl<'a> Pieces<'a> {
    /// None yet. Visual meshes are looked for in `packages`.
    pub(super) fn new(packages: &'a ResolveOptions) -> Self {
        Pieces {
            packages,
            shapes: Shapes::default(),
            collision: Vec::new(),
            looks: Vec::new(),
            are_looks_known: false,
            notes: Vec::new(),
        }
    }

    /// Adds a body of one shape.
    pub(super) fn add_body(&mut self, on: Carrier, from_mesh: &Pose, shape: &Shape) {
        let mesh = self.shapes.index_of(shape);
        let piece = PieceStory { on, role: Role::Collision, mesh, from_mesh: PoseData::from(from_mesh), is_tip: false };
        self.looks.push(as_look(&piece));
        self.collision.push(piece);
    }

    /// Adds links: what collides as hulls, with the shapes of fingertips, and what it looks like.
    pub(super) fn add_links(&mut self, links: &DrawnLinks) {
        let (places, of_tree) = (0.., &links.tree.ids);
        for (place, id) in places.zip(of_tree).filter(|(_, id)| (links.own)(**id)) {
            let first = self.collision.len();
            self.add_collision(links, place, *id);
            self.add_looks(links, place, *id, first);
        }
    }

    fn add_collision(&mut self, links: &DrawnLinks, place: usize, id: LinkId) {
        let link = &links.robot.links[id.0];
        let tip = links.fingers.iter().find(|finger| finger.tip.link == id);
        let mut add = |from_mesh: &Pose, mesh: usize| {
            let (on, from_mesh) = ((links.on)(place), PoseData::from(from_mesh));
            self.collision.push(PieceStory { on, role: Role::Collision, mesh, from_mesh, is_tip: tip.is_some() });
        };
        for placed in &link.collision {
            add(&placed.parent_from_shape, self.shapes.hull_of(&placed.shape));
        }
        if let Some(own) = tip.and_then(|finger| finger.tip.own_shape()) {
            let link_from_body = links.robot.fixed_pose_in_body(id).inverse();
            let own = PlacedShape { parent_from_shape: link_from_body * own.parent_from_shape, shape: own.shape };
            if !link.collision.iter().any(|placed| is_same_surface(placed, &own)) {
                add(&own.parent_from_shape, self.shapes.index_of(&own.shape));
            }
        }
    }

    /// What a link looks like; the pieces that collide from `first` on where nothing is known.
    fn add_looks(&mut self, links: &DrawnLinks, place: usize, id: LinkId, first: usize) {
        let link = &links.robot.links[id.0];
        let is_tip = links.fingers.iter().any(|finger| finger.tip.link == id);
        let mut mesh_of = |geometry| self.shapes.visual(geometry, self.packages);
        let visuals = link.visual.iter();
        let found: Result<Vec<(Pose, usize)>, String> =
            visuals.map(|visual| Ok((visual.parent_from_visual, mesh_of(&visual.geometry)?))).collect();
        match found {
            Ok(found) if !found.is_empty() => {
                self.are_looks_known = true;
                self.looks.extend(found.into_iter().map(|(from_mesh, mesh)| PieceStory {
                    on: (links.on)(place),
                    role: Role::Visual,
                    mesh,
                    from_mesh: PoseData::from(&from_mesh),
                    is_tip,
                }));
            }
            found => {
                if let Err(problem) = found {
                    let about = format!("Looks of {}{}", link.name, links.of_body);
                    self.notes.push((about, format!("collision geometry: {problem}")));
                }
                self.looks.extend(self.collision[first..].iter().map(as_look));
            }
        }
    }

    /// All pieces, and their meshes.
    pub(super) fn finish(mut self) -> (Vec<PieceStory>, Vec<super::MeshStory>, Vec<(String, String)>) {
        if self.are_looks_known {
            self.collision.append(&mut self.looks);
        }
        let meshes = self.shapes.packed(&mut self.notes);
        (self.collision, meshes, self.notes)
    }
}

/// The same piece as a look.
fn as_look(piece: &PieceStory) -> PieceStory {
    PieceStory { role: Role::Visual, ..piece.clone() }
}
