//! What a search prepares once and shares among its threads.

use crate::fingers::{SphereLimits, Workspheres, first_finger, meeting_point};
use crate::frames::Frames;
use crate::motors::Motors;
use crate::rough::Rough;
use crate::settings::GraspSettings;
use crate::surface::SurfacePoints;
use rayon::prelude::*;
use regrasp_geometry::Pose;
use regrasp_geometry::stable::{self, Standing};
use regrasp_grasp::list::GraspKind;
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::forces::limits::ForceModel;
use regrasp_manipulation::model::{FingerModel, Model};
use regrasp_robot::ContactModel;

/// Largest number of surface points of a tip: finer steps show nothing new.
const MOST_POINTS: f64 = 5_000.0;
/// Tips whose radii differ by less than this share points, in metres.
const SAME_RADIUS: f64 = 1e-4;

/// Everything that does not change during a search.
pub struct Prepared<'a> {
    /// Hand and object.
    pub model: &'a Model<'a>,
    /// Limits of contact forces.
    pub forces: &'a ForceModel,
    /// What is searched for.
    pub settings: &'a GraspSettings,
    /// Seed of all random numbers.
    pub seed: u64,
    /// The frames of the grid.
    pub frames: Frames,
    /// Workspaces of the fingers.
    pub workspaces: Vec<Workspheres>,
    /// Places of the surface for tips of one size each.
    surfaces: Vec<SurfacePoints>,
    /// Which of these is a finger's.
    surface_of: Vec<usize>,
    /// A rough look at collisions.
    pub rough: Rough,
    /// Fingers in the order in which they touch.
    pub order: Vec<usize>,
    /// Pose of the grasp frame in the hand frame.
    pub hand_from_grasp: Pose,
    /// Poses in which the object stands.
    pub standing: Vec<Standing>,
    /// What closes the hand; none where contacts come before joints.
    pub motors: Option<Motors>,
}

impl<'a> Prepared<'a> {
    /// Prepares a search. Errors: what makes it hopeless, in words.
    pub fn new(model: &'a Model<'a>, settings: &'a GraspSettings, seed: u64) -> Result<Self, Failure> {
        let impossible = |message: String, advice: &str| Failure::bare(FailureKind::Impossible, message, advice);
        let hand = model.view.hand;
        let object = model.view.object;
        let forces = model.forces.as_ref().ok_or_else(|| Failure::of_settings("grasps need forces"))?;
        let first =
            first_finger(hand, settings.first_finger.as_deref()).map_err(|problem| Failure::of_settings(&problem))?;
        let motors = match settings.kind {
            GraspKind::Precision => None,
            _ => Some(Motors::new(model, settings).map_err(|problem| {
                impossible(
                    problem,
                    "take kind closing for hands of more fingers, kind precision for fingers of three joints or more",
                )
            })?),
        };
        let mut order = vec![first];
        order.extend((0..hand.fingers.len()).filter(|f| *f != first));
        let limits = SphereLimits { most: settings.most_spheres, least_radius: settings.least_sphere };
        let workspaces: Vec<Workspheres> =
            model.fingers.par_iter().map(|finger| Workspheres::new(finger.ik, settings.limit_margin, limits)).collect();
        let meeting = meeting_point(&workspaces);
        let radii: Vec<f64> = model.fingers.iter().map(|finger| finger.tip_radius).collect();
        let smallest = radii.iter().copied().fold(f64::INFINITY, f64::min).max(0.004);
        let finest = (object.surface.area() / MOST_POINTS).sqrt();
        let step = settings.surface_step.unwrap_or(0.5 * smallest).max(finest);
        let (mut surfaces, mut sizes, mut surface_of) = (Vec::new(), Vec::<[f64; 2]>::new(), Vec::new());
        for finger in &model.fingers {
            let size = [finger.tip_radius, finger.settle_radius];
            let is_same = |other: &[f64; 2]| (0..2).all(|k| (other[k] - size[k]).abs() < SAME_RADIUS);
            let index = sizes.iter().position(is_same).unwrap_or_else(|| {
                sizes.push(size);
                surfaces.push(SurfacePoints::new(object, step, size[0], size[1], seed));
                sizes.len() - 1
            });
            surface_of.push(index);
        }
        if let Some(finger) = (0..surface_of.len()).find(|&f| surfaces[surface_of[f]].places.is_empty()) {
            let message = format!(
                "fingertip \"{}\" fits nowhere on \"{}\": every point of the surface is nearer than {} mm to a crease, or too \
                 narrow for it",
                hand.fingers[finger].name,
                object.name,
                1e3 * object.edge_distance
            );
            return Err(impossible(
                message,
                "a coarse mesh needs a larger crease_angle_deg, and a smaller edge_distance",
            ));
        }
        let (low, high) = object.shape.bounds();
        let (size, reach) = ((high - low).norm(), workspaces.iter().map(|w| w.bound.radius).fold(0.0, f64::max));
        // Fingers of one joint reach a line only: where they come together is what counts, and the search tells.
        if motors.is_none() && (high - low).min() > 4.0 * reach + 2.0 * smallest {
            let message = format!(
                "the object is {:.0} mm thick at its thinnest; no finger of the hand reaches {:.0} mm",
                1e3 * (high - low).min(),
                4e3 * reach
            );
            return Err(impossible(
                message,
                "take a larger hand or a smaller object; meshes in millimetres take scale = 0.001",
            ));
        }
        let tip = radii.iter().copied().fold(f64::INFINITY, f64::min);
        if size < 0.5 * tip {
            let message = format!("the object is {:.1} mm large, smaller than half a fingertip", 1e3 * size);
            return Err(impossible(message, "check its unit: meshes take a scale"));
        }
        Ok(Prepared {
            frames: Frames::new([&low, &high], settings.frames, settings.least_positions),
            hand_from_grasp: Pose::translation(meeting.x, meeting.y, meeting.z),
            standing: stable::stable_poses(&object.shape, &object.center_of_mass, settings.tipping_angle),
            rough: Rough::new(model),
            model,
            forces,
            settings,
            seed,
            workspaces,
            surfaces,
            surface_of,
            order,
            motors,
        })
    }

    /// Places that a finger's tip can touch.
    pub fn surface(&self, finger: usize) -> &SurfacePoints {
        &self.surfaces[self.surface_of[finger]]
    }

    /// Number of frames.
    pub fn n_frames(&self) -> u64 {
        match self.settings.kind {
            // Each frame is an antipodal pair with an approach angle.
            GraspKind::Gripper => self.settings.frames,
            _ => self.frames.len(),
        }
    }

    /// The base of the hand in the object frame, at frame `index`.
    pub fn object_from_hand(&self, index: u64) -> Pose {
        self.frames.object_from_grasp(index) * self.hand_from_grasp.inverse()
    }

    /// Fingers that hold at least: two if some are soft, else three, or as many as the settings ask for.
    pub fn least_contacts(&self) -> usize {
        let is_soft = |finger: &FingerModel| matches!(finger.contact, ContactModel::SoftFinger { .. });
        if self.model.fingers.iter().any(is_soft) { 2 } else { self.settings.least_contacts.max(3) }
    }
}
