//! Start and goal, and why they are refused.

use super::problem::Problem;
use crate::model::ArmModel;
use crate::motion::{Collider, ColliderSettings, Contact, Partner};
use crate::world::World;
use nalgebra::Matrix3;
use regrasp_base::Rng;
use regrasp_geometry::collision::{Placement, gap_along};
use regrasp_geometry::{Shape, Vector};
use regrasp_manipulation::failure::{Failure, FailureKind};
use regrasp_manipulation::motion_settings::MotionSettings;
use regrasp_manipulation::robot_miss::{Meeting, MetBody, MetKind, RobotMiss};

/// An end of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    Start,
    Goal,
}

impl End {
    fn name(self) -> &'static str {
        match self {
            End::Start => "start",
            End::Goal => "goal",
        }
    }

    fn kind(self) -> FailureKind {
        match self {
            End::Start => FailureKind::StartInvalid,
            End::Goal => FailureKind::GoalInvalid,
        }
    }
}

/// Values outside their limits by less than this count as rounding, in radians or metres.
const LIMIT_ROUNDING: f64 = 1e-9;

impl Problem<'_> {
    /// Refuses a start outside limits, or in which something that any joint moves collides.
    pub fn refuse_start(&self, settings: &MotionSettings) -> Result<(), Failure> {
        let all: Vec<usize> = (0..self.robot.layout.len()).collect();
        let model = self.model(&all);
        self.refuse(&model, &model.configuration_of(&self.query.start), End::Start, settings)
    }

    /// Names of the first two that are not proved to keep the clearance. None where all do.
    pub fn collision(&self, model: &ArmModel, configuration: &[f64], settings: &MotionSettings) -> Option<[String; 2]> {
        let collider = ColliderSettings { clearance: settings.clearance, ..ColliderSettings::default() };
        let contact = Collider::new(model, &self.world, collider).contact(configuration)?;
        Some(met(model, &self.world, contact).map(|body| body.name))
    }

    /// Refuses a configuration outside limits or in collision.
    pub fn refuse(
        &self,
        model: &ArmModel,
        configuration: &[f64],
        end: End,
        settings: &MotionSettings,
    ) -> Result<(), Failure> {
        if !model.is_within_limits(configuration, LIMIT_ROUNDING) {
            let beyond = model.coordinates.iter().zip(configuration).find(|(c, q)| **q < c.lower || **q > c.upper);
            let what = match beyond {
                Some((c, q)) => format!("joint \"{}\" is at {q:.4}, outside [{:.4}, {:.4}]", c.name, c.lower, c.upper),
                None => "joints that another one follows take it outside its limits".to_owned(),
            };
            let message = format!("the {} is outside the joints' limits: {what}", end.name());
            return Err(Failure::bare(end.kind(), message, "move the joint inside its limits"));
        }
        let collider = ColliderSettings { clearance: settings.clearance, ..ColliderSettings::default() };
        let mut collider = Collider::new(model, &self.world, collider);
        let Some(meeting) = meeting(&mut collider, configuration) else { return Ok(()) };
        let [first, second] = [0, 1].map(|k| meeting.bodies[k].name.clone());
        let how = match meeting.overlap {
            Some(depth) if depth > 0.0 => format!("they overlap by up to {:.1} mm", 1e3 * depth),
            Some(depth) => format!(
                "they are {:.2} mm apart, and the clearance is {:.2} mm",
                -1e3 * depth,
                1e3 * settings.clearance
            ),
            None => "they overlap".to_owned(),
        };
        let message = format!("the {} collides: \"{first}\" meets \"{second}\"; {how}", end.name());
        let advice = match nearest_free(&mut collider, configuration) {
            Some(free) => format!("the nearest free posture found: {}", changes(model, configuration, &free)),
            None => "no free posture was found near by: move the obstacle or choose another posture".to_owned(),
        };
        let mut failure = Failure::bare(end.kind(), message, &advice);
        let mut miss = RobotMiss::at(format!("{}: in collision", end.name()), model.state_at(configuration));
        miss.meeting = Some(meeting);
        failure.robot_miss = Some(Box::new(miss));
        Err(failure)
    }
}

/// The first two that are not proved to keep the clearance in a configuration, and how deep they overlap. None where all do.
pub fn meeting(collider: &mut Collider, configuration: &[f64]) -> Option<Meeting> {
    let contact = collider.contact(configuration)?;
    let bodies = met(collider.model, collider.world, contact);
    Some(Meeting { bodies, overlap: depth(collider, configuration, contact) })
}

/// The two that meet.
fn met(model: &ArmModel, world: &World, contact: Contact) -> [MetBody; 2] {
    let of_model = |body: usize| MetBody {
        name: model.bodies[body].name.clone(),
        kind: if model.bodies[body].attached.is_some() { MetKind::Carried } else { MetKind::Link },
    };
    let partner = match contact.partner {
        Partner::Obstacle(obstacle) => MetBody { name: world.obstacles[obstacle].name.clone(), kind: MetKind::Resting },
        Partner::Body(body) => of_model(body),
    };
    [of_model(contact.body), partner]
}

/// The joints that change most.
fn changes(model: &ArmModel, from: &[f64], to: &[f64]) -> String {
    let mut all: Vec<(f64, String)> = model
        .coordinates
        .iter()
        .enumerate()
        .map(|(k, c)| ((to[k] - from[k]).abs(), format!("{} = {:.4}", c.name, to[k])))
        .filter(|(change, _)| *change > 1e-4)
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let shown: Vec<String> = all.iter().take(8).map(|(_, text)| text.clone()).collect();
    let more =
        if all.len() > shown.len() { format!(" and {} more joints", all.len() - shown.len()) } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

/// How deep the two overlap, negative where they are apart. None where one is not convex.
fn depth(collider: &mut Collider, configuration: &[f64], contact: Contact) -> Option<f64> {
    let model = collider.model;
    let mut frames = Vec::new();
    model.frame_poses(configuration, &mut frames);
    let parts = |body: usize| -> Vec<(Shape, Placement)> {
        let of_model = &model.bodies[body];
        let at = of_model.frame.map_or(Placement::IDENTITY, |frame| (&frames[frame]).into());
        of_model
            .shapes
            .iter()
            .map(|placed| (placed.shape.clone(), at.then(&(&placed.parent_from_shape).into())))
            .collect()
    };
    let first = parts(contact.body);
    let second = match contact.partner {
        Partner::Body(body) => parts(body),
        Partner::Obstacle(obstacle) => {
            let placed = &collider.world.obstacles[obstacle].placed;
            vec![(placed.shape.clone(), (&placed.parent_from_shape).into())]
        }
    };
    let mut deepest = f64::NEG_INFINITY;
    for (a, at_a) in &first {
        for (b, at_b) in &second {
            if !a.is_convex() || !b.is_convex() {
                return None;
            }
            deepest = deepest.max(-largest_gap((a, at_a), (b, at_b)));
        }
    }
    Some(deepest)
}

/// The largest gap over directions: a search from many of them.
fn largest_gap((a, at_a): (&Shape, &Placement), (b, at_b): (&Shape, &Placement)) -> f64 {
    let gap = |u: &Vector| gap_along(u, a, at_a, b, at_b, &mut [0; 2]);
    let mut rng = Rng::keyed(0, "depth", 0);
    let between = at_b.translation - at_a.translation;
    let mut best = (f64::NEG_INFINITY, Vector::x());
    let axes = |rotation: &Matrix3<f64>| [0, 1, 2].map(|k| rotation.column(k).into_owned());
    let mut starts: Vec<Vector> = axes(&at_a.rotation).into_iter().chain(axes(&at_b.rotation)).collect();
    starts.extend(starts.clone().iter().map(|axis| -axis));
    starts.extend(between.try_normalize(1e-9));
    starts.extend((0..100).map(|_| Vector::from(rng.direction())));
    for u in starts {
        let value = gap(&u);
        if value > best.0 {
            best = (value, u);
        }
    }
    let mut radius = 0.3;
    while radius > 1e-4 {
        let mut is_better = false;
        for _ in 0..20 {
            let u = (best.1 + Vector::from(rng.direction()) * radius).normalize();
            let value = gap(&u);
            if value > best.0 {
                (best, is_better) = ((value, u), true);
            }
        }
        radius *= if is_better { 1.0 } else { 0.6 };
    }
    best.0
}

/// A free configuration near one that is not.
fn nearest_free(collider: &mut Collider, from: &[f64]) -> Option<Vec<f64>> {
    let model = collider.model;
    let mut rng = Rng::keyed(0, "nearest_free", 0);
    for spread in [0.02, 0.05, 0.1, 0.2, 0.4, 0.8] {
        let mut best: Option<(f64, Vec<f64>)> = None;
        for _ in 0..40 {
            let drawn = from.iter().zip(&model.coordinates);
            let mut drawn: Vec<f64> = drawn.map(|(q, c)| (q + spread * rng.normal()).clamp(c.lower, c.upper)).collect();
            model.linear_limits.iter().for_each(|limit| limit.settle(&mut drawn));
            let distance = crate::search::distance(from, &drawn);
            if best.as_ref().is_none_or(|best| distance < best.0)
                && model.is_within_limits(&drawn, 0.0)
                && collider.contact(&drawn).is_none()
            {
                best = Some((distance, drawn));
            }
        }
        if let Some((_, mut free)) = best {
            // Back as far as it stays free.
            for _ in 0..12 {
                let nearer: Vec<f64> = free.iter().zip(from).map(|(a, b)| 0.5 * (a + b)).collect();
                if collider.contact(&nearer).is_some() {
                    break;
                }
                free = nearer;
            }
            return Some(free);
        }
    }
    None
}
