//! Pictures of tracking plans, read back and compared with the plan by other ways.

use crate::charts::{number, parsed, runs};
use crate::sample::Sample;
use nalgebra::{Matrix3, Rotation3, Vector2};
use regrasp_geometry::{Point, Pose, Vector};
use regrasp_plan::plan::{ContactMode, Plan, SegmentKind};
use regrasp_viewer::storyboard::key_frames::{Event, key_frames};
use regrasp_viewer::timeline::{self, Doing};
use regrasp_viewer::{charts, palette};
use std::sync::OnceLock;

/// Half the axes of the football of scenes/football.toml, in metres.
const RADII: [f64; 3] = [0.09, 0.09, 0.12];

fn football() -> &'static Sample {
    static SAMPLE: OnceLock<Sample> = OnceLock::new();
    SAMPLE.get_or_init(Sample::football)
}

/// Rotation matrix of the object at every waypoint, from its quaternion by the textbook's formula.
fn matrices(plan: &Plan) -> Vec<Matrix3<f64>> {
    let matrix = |[x, y, z, w]: [f64; 4]| {
        Matrix3::new(
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        )
    };
    timeline::steps(plan).iter().map(|step| matrix(step.waypoint.world_from_object.quat_xyzw)).collect()
}

/// Angle of the turn between two matrices, from the length of their difference.
fn angle_between(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    2.0 * ((a - b).norm() / (2.0 * 2f64.sqrt())).min(1.0).asin()
}

#[test]
fn rotation_vectors_are_continuous_and_as_long_a_way_as_the_angles_between_waypoints() {
    let plan = &football().plan;
    let (vectors, matrices) = (timeline::rotation_vectors(plan), matrices(plan));
    for (vector, matrix) in vectors.iter().zip(&matrices) {
        assert!((Rotation3::new(*vector).matrix() - matrix).norm() < 1e-9);
    }
    assert!((vectors[0] - Vector::new(0.5, 0.7, 0.4)).norm() < 1e-6, "the scene's own: {}", vectors[0]);
    let by_matrices: f64 = matrices.windows(2).map(|pair| angle_between(&pair[0], &pair[1])).sum();
    assert!((timeline::angle_along(plan) - by_matrices).abs() < 1e-6, "{by_matrices}");
    // The way in the space of vectors, its pieces brought to angular velocities by the left Jacobian of the exponential.
    let by_vectors: f64 =
        vectors.windows(2).map(|pair| (jacobian(&((pair[0] + pair[1]) / 2.0)) * (pair[1] - pair[0])).norm()).sum();
    assert!((by_vectors / by_matrices - 1.0).abs() < 1e-4, "{by_vectors} {by_matrices}");
    assert!(by_matrices > 94f64.to_radians() * 0.98, "no way is shorter than the straight one");
}

fn jacobian(v: &Vector) -> Matrix3<f64> {
    let (angle, cross) = (v.norm(), v.cross_matrix());
    Matrix3::identity()
        + cross * ((1.0 - angle.cos()) / angle.powi(2))
        + cross * cross * ((angle - angle.sin()) / angle.powi(3))
}

#[test]
fn vectors_go_on_beyond_a_half_turn_and_beyond_a_whole_one() {
    let mut plan = football().plan.clone();
    let n = timeline::steps(&plan).len();
    let axis = Vector::new(2.0, -1.0, 2.0) / 3.0;
    for (k, waypoint) in plan.segments.iter_mut().flat_map(|segment| &mut segment.waypoints).enumerate() {
        let angle = 7.5 * k as f64 / (n - 1) as f64;
        waypoint.world_from_object = (&Pose::rotation(axis * angle)).into();
    }
    let vectors = timeline::rotation_vectors(&plan);
    for (k, vector) in vectors.iter().enumerate() {
        assert!((vector - axis * (7.5 * k as f64 / (n - 1) as f64)).norm() < 1e-6, "{k}: {vector}");
    }
    assert!((timeline::angle_along(&plan) - 7.5).abs() < 1e-6);
}

/// The drawn path and its projection together say every rotation vector: they are brought back from the picture.
#[test]
fn the_orientation_path_is_that_of_the_plan_and_coloured_by_the_moving_finger() {
    let plan = &football().plan;
    let svg = charts::orientation_path(plan).expect("a picture");
    let document = parsed(&svg);
    let of_class = |class: &str| -> Vec<_> {
        document.descendants().filter(|node| node.attribute("class") == Some(class)).collect()
    };
    let shadow: Vec<[f64; 2]> = runs(&of_class("projection")[0]).concat();
    let paths = of_class("path");
    assert_eq!(paths.len(), plan.segments.len());
    for (path, segment) in paths.iter().zip(&plan.segments) {
        let finger = plan.fingers.iter().position(|name| Some(name) == segment.moving_finger.as_ref()).unwrap();
        assert_eq!(path.attribute("stroke"), Some(palette::color(finger)));
    }
    let drawn: Vec<[f64; 2]> = paths.iter().flat_map(|path| runs(path).concat()).collect();
    let matrices = matrices(plan);
    assert_eq!((drawn.len(), shadow.len()), (matrices.len(), matrices.len()));
    // Affine maps of the plane, and the length of z, from four known vectors: those of start and end, and their feet.
    let vectors: Vec<Vector> =
        matrices.iter().map(|matrix| Rotation3::from_matrix_unchecked(*matrix).scaled_axis()).collect();
    let (first, last, middle) = (0, vectors.len() - 1, vectors.len() / 2);
    let place = |k: usize| Vector2::from(shadow[k]);
    let plane = |k: usize| Vector2::new(vectors[k].x, vectors[k].y);
    let known = nalgebra::Matrix2::from_columns(&[plane(last) - plane(first), plane(middle) - plane(first)]);
    let seen = nalgebra::Matrix2::from_columns(&[place(last) - place(first), place(middle) - place(first)]);
    let back = known * seen.try_inverse().expect("the path is not straight on the plane");
    let per_radian = (shadow[last][1] - drawn[last][1]) / vectors[last].z;
    for (k, matrix) in matrices.iter().enumerate() {
        let on_plane = plane(first) + back * (place(k) - place(first));
        assert!((drawn[k][0] - shadow[k][0]).abs() < 0.02, "z points straight up on the sheet");
        let vector = Vector::new(on_plane.x, on_plane.y, (shadow[k][1] - drawn[k][1]) / per_radian);
        let off = angle_between(Rotation3::new(vector).matrix(), matrix);
        assert!(off < 2e-3, "waypoint {k}: {off} rad");
    }
    let start = &of_class("start")[0];
    assert_eq!([number(start, "cx"), number(start, "cy")], drawn[0]);
    let goal = Rotation3::new(Vector::new(-0.6, -0.5, 0.8));
    let left = angle_between(goal.matrix(), &matrices[last]);
    let corners: Vec<Vec<f64>> = of_class("goal")[0]
        .attribute("points")
        .unwrap()
        .split(' ')
        .map(|corner| corner.split(',').map(|c| c.parse().unwrap()).collect())
        .collect();
    let center = [0, 1].map(|c| corners.iter().map(|corner| corner[c]).sum::<f64>() / 4.0);
    let off = (center[0] - drawn[last][0]).hypot(center[1] - drawn[last][1]);
    assert!(off < 2.0 * per_radian * left + 0.1, "{off} for {left} rad");
    let told = format!("turned {:.1}\u{b0} along the path", timeline::angle_along(plan).to_degrees());
    assert!(svg.contains(&told), "{told}");
}

#[test]
fn traces_lie_on_the_surface_and_are_drawn_where_they_are() {
    let sample = football();
    let plan = &sample.plan;
    let on_surface = |p: &Point| (0..3).map(|k| (p[k] / RADII[k]).powi(2)).sum::<f64>();
    let traces: Vec<Vec<(Point, Vector)>> =
        (0..4).map(|finger| timeline::trace(plan, finger).into_iter().flatten().collect()).collect();
    for trace in &traces {
        assert_eq!(trace.len(), timeline::steps(plan).len(), "no finger leaves the object");
        assert!(trace.iter().all(|(point, _)| (on_surface(point) - 1.0).abs() < 1e-6));
    }
    let story = sample.story();
    let svg = charts::traces(plan, &story.scene).expect("a picture");
    let document = parsed(&svg);
    // Right and up of every view, in the order of the picture; the viewer looks against their cross product.
    let axes = [
        [Vector::y(), Vector::z()],
        [-Vector::x(), Vector::z()],
        [Vector::x(), Vector::y()],
        [-Vector::y(), Vector::z()],
        [Vector::x(), Vector::z()],
        [Vector::x(), -Vector::y()],
    ];
    let outlines: Vec<_> = document.descendants().filter(|node| node.attribute("class") == Some("outline")).collect();
    assert_eq!(outlines.len(), 6);
    let mut n_drawn = 0;
    for (view, ([right, up], outline)) in axes.iter().zip(&outlines).enumerate() {
        let corners: Vec<f64> =
            outline.attribute("points").unwrap().split([' ', ',']).map(|c| c.parse().unwrap()).collect();
        let range = |axis: usize| {
            let values = corners.iter().skip(axis).step_by(2).copied();
            (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max))
        };
        let ((left, far_right), (top, bottom)) = (range(0), range(1));
        // The outline is as wide and as high as the ellipsoid, but for the faces of its mesh.
        let extent = |axis: &Vector| 2.0 * (0..3).map(|k| (axis[k] * RADII[k]).abs()).fold(0.0, f64::max);
        let scale = (far_right - left) / extent(right);
        assert!(((bottom - top) / extent(up) / scale - 1.0).abs() < 0.02);
        let middle = [(left + far_right) / 2.0, (top + bottom) / 2.0];
        let place = |p: &Point| [middle[0] + scale * p.coords.dot(right), middle[1] - scale * p.coords.dot(up)];
        let toward = right.cross(up);
        for (finger, trace) in traces.iter().enumerate() {
            let class = format!("trace{finger} view{view}");
            let path = document.descendants().find(|node| node.attribute("class") == Some(class.as_str()));
            let points: Vec<[f64; 2]> = path.map_or_else(Vec::new, |path| runs(&path).concat());
            n_drawn += points.len();
            let seen: Vec<[f64; 2]> = trace
                .iter()
                .filter(|(point, _)| (0..3).map(|k| point[k] / RADII[k].powi(2) * toward[k]).sum::<f64>() > 0.0)
                .map(|(point, _)| place(point))
                .collect();
            let off = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            let near = |a: &[f64; 2], all: &[[f64; 2]]| all.iter().any(|b| off(a, b) < 1.5);
            assert!(
                points.iter().all(|a| near(a, &seen)),
                "view {view}, finger {finger}: drawn where no contact is seen"
            );
            assert!(seen.iter().all(|a| near(a, &points)), "view {view}, finger {finger}: a contact is not drawn");
        }
    }
    assert!(n_drawn > 100, "{n_drawn}");
}

/// Seconds in which a finger slides, holds or rolls, counted waypoint by waypoint, and those in which it is the moving one.
#[test]
fn the_gait_tells_sliding_from_rolling_and_marks_who_moves_and_who_is_rolled_on() {
    let plan = &football().plan;
    let svg = charts::gait(plan);
    let document = parsed(&svg);
    let span = timeline::span(plan);
    for finger in 0..plan.fingers.len() {
        let (mut slides, mut rolls, mut moves, mut rolled_on) = (0.0, 0.0, 0.0, 0.0);
        for segment in &plan.segments {
            assert_eq!(segment.kind, SegmentKind::Tracking);
            let time = segment.waypoints.last().unwrap().time - segment.waypoints[0].time;
            moves += time * f64::from(segment.moving_finger.as_ref() == Some(&plan.fingers[finger]));
            rolled_on += time * f64::from(segment.rolling_finger.as_ref() == Some(&plan.fingers[finger]));
            for pair in segment.waypoints.windows(2) {
                let step = pair[1].time - pair[0].time;
                match pair[0].contacts[finger].mode {
                    ContactMode::Sliding | ContactMode::PureSliding => slides += step,
                    ContactMode::Rolling | ContactMode::PureRolling | ContactMode::Twisting => rolls += step,
                    ContactMode::Fixed | ContactMode::Free => {}
                }
            }
        }
        let stretches = timeline::stretches(plan, finger);
        let told =
            |doing: Doing| -> f64 { stretches.iter().filter(|s| s.doing == doing).map(|s| s.until - s.from).sum() };
        assert!((told(Doing::Slides) - slides).abs() < 1e-9 * span.1, "{} {slides}", told(Doing::Slides));
        assert!((told(Doing::Rolls) - rolls).abs() < 1e-9 * span.1, "{} {rolls}", told(Doing::Rolls));
        assert_eq!(told(Doing::Moves) + told(Doing::Waits), 0.0, "no finger leaves the object");
        assert_eq!(timeline::marks(plan, finger), timeline::Marks::default());
        // In the picture: lengths in the finger's row, over that of the plan.
        let frame =
            document.descendants().filter(|n| n.attribute("fill") == Some("none")).find_map(|n| n.attribute("width"));
        let width: f64 = frame.expect("a frame").parse().unwrap();
        let drawn = |attribute: &str, value: &str, row: Option<usize>| -> f64 {
            document
                .descendants()
                .filter(|node| node.has_tag_name("rect") && node.attribute(attribute) == Some(value))
                .filter(|node| row.is_none_or(|row| ((number(node, "y") - 32.0) / 30.0).floor() as usize == row))
                .map(|node| number(&node, "width") / width * (span.1 - span.0))
                .sum()
        };
        let near = |a: f64, b: f64| (a - b).abs() < 0.02 * (span.1 - span.0);
        assert!(near(drawn("fill", &format!("url(#slide{finger})"), None), slides), "{slides}");
        assert!(near(drawn("fill", &format!("url(#roll{finger})"), None), rolls), "{rolls}");
        // Ramps between two segments with the same roles belong to them.
        let (moving, under) = (drawn("class", "moving", Some(finger)), drawn("class", "rolled-on", Some(finger)));
        assert!(moving >= moves - 0.5 && under >= rolled_on - 0.5, "{moving} {moves}, {under} {rolled_on}");
    }
    let roles = timeline::roles(plan);
    let all: f64 = roles.iter().map(|roles| roles.until - roles.from).sum();
    assert!(
        all <= span.1 - span.0 + 1e-9
            && roles.iter().all(|roles| roles.rolling.is_some_and(|rolling| !roles.moving.contains(&rolling)))
    );
    assert!(svg.contains(">slides<") && svg.contains(">moving finger<") && !svg.contains(">lifts<"));
}

#[test]
fn all_fingers_that_move_are_marked() {
    let mut plan = football().plan.clone();
    plan.segments.iter_mut().for_each(|segment| segment.also_moving.clear());
    let strips = |plan: &Plan| charts::gait(plan).matches("class=\"moving\"").count();
    let before = (strips(&plan), timeline::roles(&plan));
    for segment in &mut plan.segments {
        let rests = |name: &&String| {
            segment.moving_finger.as_ref() != Some(name) && segment.rolling_finger.as_ref() != Some(name)
        };
        segment.also_moving = plan.fingers.iter().filter(rests).take(1).cloned().collect();
    }
    assert_eq!(strips(&plan), 2 * before.0);
    for (after, before) in timeline::roles(&plan).iter().zip(&before.1) {
        assert_eq!((after.moving.len(), after.moving[0], after.rolling), (2, before.moving[0], before.rolling));
    }
}

#[test]
fn charts_facts_and_frames_say_nothing_of_transfers_and_relocations() {
    let story = football().story();
    let names: Vec<&str> = charts::all(&story).iter().map(|chart| chart.0).collect();
    assert_eq!(names, ["gait", "clearance", "joints", "forces", "orientation", "orientation_path", "traces"]);
    let told: Vec<&str> = story.facts.iter().map(|(label, _)| label.as_str()).collect();
    assert!(told.contains(&"Sub-goals") && !told.contains(&"Transfers") && !told.contains(&"Relocations"), "{told:?}");
    assert!(charts::gait(&football().plan).contains("sub-goals"));
    let frames = key_frames(&story.scene, &football().plan, 6);
    assert_eq!(frames.len(), 6);
    for frame in &frames {
        assert_eq!(frame.traces.len(), 4);
        for (trace, contact) in frame.traces.iter().zip(&frame.contacts) {
            assert_eq!(trace.len(), frame.step + 1, "from the beginning until then");
            assert_eq!(trace.last().map(|p| [p.x, p.y, p.z]), contact.point_in_object);
        }
    }
    for frame in &frames[1..5] {
        let segment = &football().plan.segments[timeline::steps(&football().plan)[frame.step].segment];
        assert_eq!(frame.event, Event::Tracks);
        let [moving, rolling] = [frame.moving, frame.rolling].map(|f| f.map(|f| football().plan.fingers[f].clone()));
        assert_eq!((&moving, &rolling), (&segment.moving_finger, &segment.rolling_finger));
        let text = frame.text(moving.as_deref(), rolling.as_deref());
        assert!(text.ends_with(" rolls") && !text.contains("relocates"), "{text}");
    }
}

#[test]
fn in_hand_plans_have_no_pictures_of_tracking() {
    let story = Sample::sphere().story();
    let names: Vec<&str> = charts::all(&story).iter().map(|chart| chart.0).collect();
    assert!(!names.contains(&"traces") && !names.contains(&"orientation_path"), "{names:?}");
    let plan = story.plan.as_ref().expect("a plan");
    assert_eq!(timeline::roles(plan), []);
    assert!(charts::gait(plan).contains(">lifts<"));
}
