//! Small pictures of grasps: outline of the object, fingers as lines, contacts as discs. All are seen from one side, so that the
//! object is drawn once.

use crate::palette;
use regrasp_geometry::collision::support::{core_radius, core_support};
use regrasp_geometry::{Point, Pose, Shape, Vector};
use regrasp_plan::grasps::{GraspList, ListedGrasp};
use regrasp_robot::Hand;
use regrasp_scene::GraspScene;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Width and height of a picture, in pixels.
const SIZE: f64 = 180.0;
/// Radius of the object over half the size of a picture: hands are larger than objects.
const OBJECT_SHARE: f64 = 0.42;
/// Directions of an outline.
const DIRECTIONS: usize = 72;
/// Most edges of an outline: scans have many.
const MOST_EDGES: usize = 3_000;

/// The side from which everything is seen.
pub(super) struct View<'a> {
    hand: &'a Hand,
    shape: &'a Shape,
    center: Point,
    right: Vector,
    up: Vector,
    toward: Vector,
    scale: f64,
}

impl<'a> View<'a> {
    pub(super) fn new(scene: &'a GraspScene) -> Self {
        let task = scene.manipulation();
        let toward = Vector::new(1.0, -1.4, 0.9).normalize();
        let right = Vector::z().cross(&toward).normalize();
        let object = task.object();
        View {
            hand: task.hand(),
            shape: &object.shape,
            center: object.center_of_mass,
            right,
            up: toward.cross(&right),
            toward,
            scale: 0.5 * SIZE * OBJECT_SHARE / object.radius,
        }
    }

    fn see(&self, point: &Point) -> [f64; 2] {
        let arm = point - self.center;
        [0.5 * SIZE + arm.dot(&self.right) * self.scale, 0.5 * SIZE - arm.dot(&self.up) * self.scale]
    }

    /// The object, to be used by all pictures.
    pub(super) fn symbols(&self) -> String {
        format!(
            "<svg width=\"0\" height=\"0\"><symbol id=\"object\" viewBox=\"0 0 {SIZE} {SIZE}\" \
             overflow=\"visible\">{}</symbol></svg>\n",
            self.object()
        )
    }

    fn object(&self) -> String {
        let outline = |support: &dyn Fn(&Vector) -> Point| {
            let points: Vec<String> = (0..DIRECTIONS)
                .map(|k| {
                    let (sine, cosine) = (std::f64::consts::TAU * k as f64 / DIRECTIONS as f64).sin_cos();
                    let [x, y] = self.see(&support(&(self.right * cosine + self.up * sine)));
                    format!("{x:.1},{y:.1}")
                })
                .collect();
            format!("<polygon points=\"{}\" fill=\"#eee\" stroke=\"#999\"/>", points.join(" "))
        };
        match self.shape {
            Shape::Mesh(mesh) => {
                let farthest = |direction: &Vector| {
                    let key = |p: &&Point| p.coords.dot(direction);
                    mesh.vertices().iter().max_by(|a, b| key(a).total_cmp(&key(b))).copied().unwrap_or(self.center)
                };
                outline(&farthest) + &self.edges(mesh.vertices(), mesh.triangles())
            }
            Shape::Convex(hull) => {
                outline(&|direction| hull.support(direction, &mut 0)) + &self.edges(hull.vertices(), hull.triangles())
            }
            shape => outline(&|direction| core_support(shape, direction, &mut 0) + direction * core_radius(shape)),
        }
    }

    /// Edges between a triangle that faces the viewer and one that does not.
    fn edges(&self, vertices: &[Point], triangles: &[[u32; 3]]) -> String {
        let mut sides: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        for &[a, b, c] in triangles {
            let [p, q, r] = [a, b, c].map(|i| vertices[i as usize]);
            let faces = if (q - p).cross(&(r - p)).dot(&self.toward) > 0.0 { 1 } else { -1 };
            for [from, to] in [[a, b], [b, c], [c, a]] {
                *sides.entry([from.min(to), from.max(to)]).or_default() += faces;
            }
        }
        let mut path = String::from("<path fill=\"none\" stroke=\"#888\" stroke-width=\"0.7\" d=\"");
        let border: Vec<_> = sides.into_iter().filter(|(_, sum)| *sum == 0).collect();
        for ([from, to], _) in border.iter().step_by(border.len().div_ceil(MOST_EDGES).max(1)) {
            let ([x, y], [u, v]) = (self.see(&vertices[*from as usize]), self.see(&vertices[*to as usize]));
            let _ = write!(path, "M{x:.1} {y:.1}L{u:.1} {v:.1}");
        }
        path + "\"/>"
    }

    /// One grasp.
    pub(super) fn grasp(&self, grasp: &ListedGrasp, list: &GraspList) -> String {
        let mut out = open();
        let object_from_hand = Pose::from(&grasp.object_from_hand);
        let base = self.see(&(object_from_hand * Point::origin()));
        let mut first = 0;
        for (f, finger) in self.hand.fingers.iter().enumerate() {
            let end = first + finger.chain.n_coordinates();
            let Some(joints) = grasp.joints.get(first..end) else { break };
            first = end;
            let mut bodies = Vec::new();
            finger.chain.forward(joints, &mut bodies);
            let mut path = format!("M{:.1} {:.1}", base[0], base[1]);
            let tip = finger.ik.tip(joints);
            let origins = bodies.iter().map(|body| Point::from(body.translation.vector)).chain([tip]);
            for point in origins {
                let [x, y] = self.see(&(object_from_hand * point));
                let _ = write!(path, "L{x:.1} {y:.1}");
            }
            let color = palette::color(f);
            let _ = write!(
                out,
                "<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"3\" stroke-linejoin=\"round\" \
                 opacity=\"0.8\"/>"
            );
        }
        self.add_contacts(grasp, list, 3.5, &mut out);
        let _ = write!(out, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"4\" fill=\"#333\"/></svg>", base[0], base[1]);
        out
    }

    /// The contacts of all grasps on the object.
    pub(super) fn all_contacts(&self, list: &GraspList) -> String {
        let mut out = open();
        for grasp in &list.grasps {
            self.add_contacts(grasp, list, 1.5, &mut out);
        }
        out + "</svg>"
    }

    /// Contacts as discs; those behind the object are pale.
    fn add_contacts(&self, grasp: &ListedGrasp, list: &GraspList, radius: f64, out: &mut String) {
        for contact in &grasp.contacts {
            let [x, y] = self.see(&Point::from(contact.point_in_object));
            let number = list.hand.fingers.iter().position(|finger| *finger == contact.finger).unwrap_or(0);
            let is_behind = Vector::from(contact.normal_in_object).dot(&self.toward) < 0.0;
            let opacity = if is_behind { 0.4 } else { 1.0 };
            let color = palette::color(number);
            let _ = write!(
                out,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{color}\" opacity=\"{opacity}\"/>"
            );
        }
    }
}

fn open() -> String {
    format!("<svg width=\"{SIZE}\" height=\"{SIZE}\" viewBox=\"0 0 {SIZE} {SIZE}\"><use href=\"#object\"/>")
}
