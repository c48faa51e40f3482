//! Balls over edges and vertices, and equations 14 to 16.

use super::super::ball_on_polyhedron::{Ball, BallContact, BallWay, Transition, advance_with_jumps, relocate};
use super::super::chart::ChartedSurface;
use super::super::montana::ContactPair;
use super::super::polyhedron::{Feature, NotPolyhedron, Polyhedron};
use super::super::{ContactPose, NoStep, RelativeVelocity};
use super::{apart, differenced};
use crate::contact::rolling;
use nalgebra::UnitQuaternion;
use regrasp_base::Rng;
use regrasp_geometry::{ConvexHull, Point, Pose, Shape, Surface, Vector};
use std::sync::Arc;

fn cube() -> Shape {
    Shape::Cuboid { half_extents: Vector::repeat(0.1) }
}

/// A bipyramid over a hexagon, 0.35 m high and 0.25 m wide.
fn diamond() -> Shape {
    let ring = (0..6).map(|k| f64::from(k) * std::f64::consts::TAU / 6.0);
    let mut points: Vec<Point> = ring.map(|a| Point::new(0.125 * a.cos(), 0.125 * a.sin(), 0.02)).collect();
    points.extend([Point::new(0.0, 0.0, 0.175), Point::new(0.0, 0.0, -0.175)]);
    Shape::Convex(Arc::new(ConvexHull::new(&points).unwrap()))
}

fn any_hull(rng: &mut Rng) -> Shape {
    let points: Vec<Point> =
        (0..14).map(|_| Point::from(Vector::from(rng.direction()) * rng.uniform(0.08, 0.12))).collect();
    Shape::Convex(Arc::new(ConvexHull::new(&points).unwrap()))
}

fn any_ball(rng: &mut Rng) -> Ball {
    Ball { center_in_tip: Point::from(Vector::from(rng.direction()) * 0.01), radius: rng.uniform(0.02, 0.04) }
}

/// A ball somewhere on a face.
fn any_start(polyhedron: &Polyhedron, ball: &Ball, rng: &mut Rng) -> BallContact {
    let f = rng.below(polyhedron.faces().len());
    let face = &polyhedron.faces()[f];
    let weights: Vec<f64> = face.corners.iter().map(|_| rng.uniform(0.05, 1.0)).collect();
    let sum: Vector = face.corners.iter().zip(&weights).map(|(&i, w)| polyhedron.vertices()[i].coords * *w).sum();
    let point = Point::from(sum / weights.iter().sum::<f64>());
    let turn = UnitQuaternion::from_scaled_axis(Vector::from(rng.direction()) * rng.uniform(0.0, 3.0));
    let start = ball.touching(Feature::Face(f), &point, &face.normal, &turn);
    BallContact { pose: start.pose.turned_by(rng.uniform(-3.0, 3.0)), ..start }
}

fn velocities(rng: &mut Rng) -> [RelativeVelocity; 5] {
    let mut v = |size: f64| rng.normal() * size;
    let rolling = RelativeVelocity::rolling(v(1.0), v(1.0));
    let sliding = RelativeVelocity::sliding(v(0.02), v(0.02));
    let twisting = RelativeVelocity::twisting(v(1.0));
    let turning = RelativeVelocity { linear: Vector::zeros(), angular: Vector::new(v(1.0), v(1.0), v(1.0)) };
    let all = RelativeVelocity { linear: Vector::new(v(0.02), v(0.02), 0.0), ..turning };
    [rolling, sliding, twisting, turning, all]
}

#[test]
fn polyhedra_have_their_faces_edges_and_vertices() {
    let mut rng = Rng::keyed(1, "polyhedra", 0);
    for (shape, n_faces, n_edges, n_vertices) in [(cube(), 6, 12, 8), (diamond(), 12, 18, 8)] {
        let polyhedron = Polyhedron::of(&shape).unwrap();
        assert_eq!((polyhedron.faces().len(), polyhedron.edges().len()), (n_faces, n_edges));
        assert_eq!(polyhedron.vertices().len(), n_vertices);
    }
    assert!(
        Polyhedron::of(&cube()).unwrap().edges().iter().all(|e| (e.exterior_angle.to_degrees() - 90.0).abs() < 1e-9)
    );
    for shape in [cube(), diamond(), any_hull(&mut rng), any_hull(&mut rng)] {
        let polyhedron = Polyhedron::of(&shape).unwrap();
        let used = (0..polyhedron.vertices().len()).filter(|&v| !polyhedron.spokes(v).is_empty()).count();
        assert_eq!(used + polyhedron.faces().len(), polyhedron.edges().len() + 2, "Euler");
        for edge in polyhedron.edges() {
            assert!(edge.exterior_angle > 0.0);
            let [p, q] = edge.faces.map(|f| polyhedron.faces()[f].normal.into_inner());
            let folded = UnitQuaternion::from_axis_angle(&edge.direction, edge.exterior_angle) * p;
            assert!((folded - q).norm() < 1e-12);
        }
        for (f, face) in polyhedron.faces().iter().enumerate() {
            let middle = Point::from(face.object_from_face.translation.vector);
            assert!(polyhedron.depths(f, &middle).all(|depth| depth > 0.0));
            assert!((face.object_from_face * Vector::z() - face.normal.into_inner()).norm() < 1e-12);
            assert!(polyhedron.vertices().iter().all(|v| face.normal.dot(&(v - middle)) < 1e-9));
        }
    }
    assert_eq!(Polyhedron::of(&Shape::Sphere { radius: 1.0 }), Err(NotPolyhedron::Kind { kind: "sphere" }));
}

/// Along random ways over faces, edges and vertices the ball keeps touching, measured on the surface; its poses move as asked,
/// measured by differences; nothing jumps.
#[test]
fn balls_keep_touching_and_move_as_asked_over_edges_and_vertices() {
    let mut rng = Rng::keyed(2, "polyhedra", 0);
    let (mut n_edges, mut n_vertices, mut worst, mut fastest_jump) = (0, 0, 0.0, 0.0);
    let shapes = [cube(), diamond(), any_hull(&mut rng)];
    for shape in &shapes {
        let (polyhedron, surface) = (Polyhedron::of(shape).unwrap(), Surface::of(shape).unwrap());
        for _ in 0..60 {
            let ball = any_ball(&mut rng);
            let start = any_start(&polyhedron, &ball, &mut rng);
            for velocity in velocities(&mut rng) {
                let duration = 20.0;
                let way = BallWay::of(&polyhedron, &ball, &start, &velocity, duration).unwrap();
                let total: f64 = way.stretches().iter().map(|s| s.duration).sum();
                assert!((total - duration).abs() < 1e-9);
                let count =
                    |kind: fn(&Feature) -> bool| way.stretches().iter().filter(|s| kind(&s.from.feature)).count();
                n_edges += count(|f| matches!(f, Feature::Edge(_)));
                n_vertices += count(|f| matches!(f, Feature::Vertex(_)));
                assert!(apart(&way.at(0.0).pose.object_from_tip(), &start.pose.object_from_tip(), 1.0) < 1e-12);
                let mut borders = vec![0.0];
                for stretch in way.stretches() {
                    borders.push(borders[borders.len() - 1] + stretch.duration);
                }
                for _ in 0..40 {
                    let time = rng.uniform(0.0, duration);
                    let at = way.at(time);
                    let center = at.center_in_object(&ball);
                    worst = f64::max(worst, (surface.signed_distance(&center) - ball.radius).abs());
                    let by_tip = at.pose.object_from_tip() * ball.center_in_tip;
                    worst = f64::max(worst, (by_tip - center).norm());
                    let step = 1e-5;
                    let [before, after] = [time - step, time + step].map(|t| way.at(t).pose.object_from_tip());
                    let speed = velocity.linear.norm() + velocity.angular.norm();
                    fastest_jump = f64::max(fastest_jump, apart(&before, &after, 0.1) / (2.0 * step * (1.0 + speed)));
                    if borders.iter().any(|border| (border - time).abs() < 2.0 * step) {
                        continue;
                    }
                    let measured = differenced(&before, &after, &at.pose, step);
                    assert!((measured.linear - velocity.linear).norm() < 1e-8, "{measured:?} {velocity:?}");
                    assert!((measured.angular - velocity.angular).norm() < 1e-7, "{measured:?} {velocity:?}");
                }
                // Densely about every border.
                for border in &borders[1..borders.len() - 1] {
                    let [before, after] = [border - 1e-9, border + 1e-9].map(|t| way.at(t));
                    assert!(apart(&before.pose.object_from_tip(), &after.pose.object_from_tip(), 0.1) < 1e-7);
                    assert!(apart(&before.pose.object_from_contact, &after.pose.object_from_contact, 0.1) < 1e-7);
                }
            }
        }
    }
    assert!(worst < 1e-9 && fastest_jump < 1.0, "{worst} {fastest_jump}");
    assert!(n_edges > 300 && n_vertices > 10, "{n_edges} {n_vertices}");
}

/// Straight for a vertex and straight along an edge.
#[test]
fn balls_pivot_about_vertices() {
    let ball = Ball { center_in_tip: Point::origin(), radius: 0.03 };
    for (shape, n_on_vertices) in [(cube(), 1), (diamond(), 1)] {
        let (polyhedron, surface) = (Polyhedron::of(&shape).unwrap(), Surface::of(&shape).unwrap());
        for (f, face) in polyhedron.faces().iter().enumerate() {
            for &v in &face.corners {
                let middle = Point::from(face.object_from_face.translation.vector);
                let start = ball.touching(Feature::Face(f), &middle, &face.normal, &UnitQuaternion::identity());
                let aim = start.pose.object_from_contact.inverse() * polyhedron.vertices()[v];
                // Sliding moves the tip against the object's velocity.
                let velocity = RelativeVelocity::sliding(-aim.x, -aim.y);
                let way = BallWay::of(&polyhedron, &ball, &start, &velocity, 1.5).unwrap();
                let met: Vec<Feature> = way.stretches().iter().map(|s| s.from.feature).collect();
                assert!(met.iter().filter(|f| **f == Feature::Vertex(v)).count() == n_on_vertices, "{met:?}");
                for k in 0..=300 {
                    let at = way.at(f64::from(k) * 0.005);
                    let center = at.center_in_object(&ball);
                    assert!((surface.signed_distance(&center) - ball.radius).abs() < 1e-9);
                    let turned = at.pose.object_from_tip().rotation.angle_to(&UnitQuaternion::identity());
                    assert!(turned < 1e-7, "sliding keeps the orientation: {turned}");
                    if at.feature == Feature::Vertex(v) {
                        assert!(
                            (at.pose.object_from_contact.translation.vector - polyhedron.vertices()[v].coords).norm()
                                < 1e-12
                        );
                    }
                }
                // And from the vertex along an edge, seen as any of the three.
                let spoke = polyhedron.spokes(v)[0];
                let e = polyhedron
                    .edges()
                    .iter()
                    .position(|e| e.ends.contains(&v) && e.direction.cross(&spoke).norm() < 1e-9);
                let edge = &polyhedron.edges()[e.unwrap()];
                let n = edge.faces.map(|f| polyhedron.faces()[f].normal.into_inner());
                let on = regrasp_geometry::UnitVector::new_normalize(n[0] + n[1]);
                let place = polyhedron.vertices()[v] + spoke * 0.01;
                let start = ball.touching(Feature::Edge(e.unwrap()), &place, &on, &UnitQuaternion::identity());
                let along = start.pose.object_from_contact.rotation.inverse() * -spoke;
                let velocity = RelativeVelocity::sliding(0.01 * along.x, 0.01 * along.y);
                let way = BallWay::of(&polyhedron, &ball, &start, &velocity, 0.5).unwrap();
                assert_eq!(way.stretches().len(), 1);
                let went = way.end().pose.object_from_contact.translation.vector - place.coords;
                assert!((went - spoke * 0.005).norm() < 1e-12);
            }
        }
    }
}

/// Over an edge, rolling: the contact on the tip stays while the ball goes round, and the midpoint rule finds no slip.
#[test]
fn rolling_round_an_edge_keeps_the_contact_on_the_tip() {
    let mut rng = Rng::keyed(4, "polyhedra", 0);
    for shape in [cube(), diamond()] {
        let polyhedron = Polyhedron::of(&shape).unwrap();
        for edge in polyhedron.edges() {
            let ball = any_ball(&mut rng);
            let (start, time) = approaching(&polyhedron, &ball, edge, &mut rng);
            let over_tip = |contact: &BallContact| Point::from(contact.pose.tip_from_contact.translation.vector);
            let angular = start.pose.object_from_contact.rotation.inverse() * -edge.direction.into_inner();
            let velocity = RelativeVelocity { linear: Vector::zeros(), angular };
            let way = BallWay::of(&polyhedron, &ball, &start, &velocity, time + edge.exterior_angle + 0.05).unwrap();
            let [reached, left] = [time, time + edge.exterior_angle].map(|t| way.at(t));
            assert!((over_tip(&reached) - over_tip(&left)).norm() < 1e-12, "equation 16");
            let turned = left.pose.object_from_tip().rotation * reached.pose.object_from_tip().rotation.inverse();
            let expected = UnitQuaternion::from_axis_angle(&edge.direction, edge.exterior_angle);
            assert!(turned.angle_to(&expected) < 1e-7);
            let places = [reached, left].map(|c| c.pose.object_from_contact.translation.vector);
            assert!((places[0] - places[1]).norm() < 1e-12, "the contact on the edge stays");
            assert_eq!(way.end().feature, Feature::Face(edge.faces[1]));
            let slip = |from: f64, to: f64| {
                let [a, b] = [way.at(from), way.at(to)];
                let [from, to] = [a, b].map(|c| rolling::Ball {
                    center: c.center_in_object(&ball),
                    normal: c.pose.object_from_contact * Vector::z(),
                });
                let matrix = |c: &BallContact| *c.pose.object_from_tip().rotation.to_rotation_matrix().matrix();
                rolling::slip(ball.radius, &from, &to, &rolling::turn_between(&matrix(&a), &matrix(&b))).norm()
            };
            let begin = time + 0.1 * edge.exterior_angle;
            let [coarse, fine] = [0.4, 0.2].map(|share| slip(begin, begin + share * edge.exterior_angle));
            assert!((7.5..8.5).contains(&(coarse / fine)), "{coarse} {fine}");
        }
    }
}

/// A ball on the left face of an edge, which it reaches at one radian or its own length per second after the time returned.
fn approaching(
    polyhedron: &Polyhedron,
    ball: &Ball,
    edge: &super::super::polyhedron::Edge,
    rng: &mut Rng,
) -> (BallContact, f64) {
    let left = &polyhedron.faces()[edge.faces[0]];
    let inward = left.normal.cross(&edge.direction);
    let time = rng.uniform(0.05, 0.3);
    let on_edge = polyhedron.vertices()[edge.ends[0]] + edge.direction.into_inner() * (edge.length * 0.5);
    let turn = UnitQuaternion::from_scaled_axis(Vector::from(rng.direction()) * 2.0);
    let start =
        ball.touching(Feature::Face(edge.faces[0]), &(on_edge + inward * (ball.radius * time)), &left.normal, &turn);
    (BallContact { pose: start.pose.turned_by(rng.uniform(-3.0, 3.0)), ..start }, time)
}

/// Equations 14 and 15 in Cherif 1999's words, with the length and the sign that they lack.
#[test]
fn folding_over_an_edge_is_the_papers_with_its_errors_put_right() {
    let mut rng = Rng::keyed(5, "polyhedra", 0);
    let (mut n_wrong_signs, mut n_sliding_off) = (0, 0);
    for shape in [cube(), diamond()] {
        let polyhedron = Polyhedron::of(&shape).unwrap();
        for edge in polyhedron.edges() {
            let ball = any_ball(&mut rng);
            let (start, _) = approaching(&polyhedron, &ball, edge, &mut rng);
            let [p, q] = edge.faces.map(|f| &polyhedron.faces()[f]);
            let u = edge.direction.into_inner();
            // Some way over the edge in the plane of p.
            let c1 = Point::from(start.pose.object_from_contact.translation.vector);
            let way = u.cross(&p.normal) * rng.uniform(0.03, 0.05) + u * rng.uniform(-0.02, 0.02);
            let c2 = c1 + way;
            let moved = Pose::translation(way.x, way.y, way.z) * start.pose.object_from_contact;
            let beyond = ContactPose { object_from_contact: moved, ..start.pose };
            let share = (c1 - polyhedron.vertices()[edge.ends[0]]).dot(&u.cross(&p.normal)).abs()
                / way.dot(&u.cross(&p.normal));
            let on_edge = c1 + way * share;

            let cosine = way.dot(&u) / way.norm();
            let c3 = [-1.0, 1.0].map(|sign| {
                let turn = UnitQuaternion::from_axis_angle(&q.normal, sign * cosine.acos());
                on_edge + turn * u * (c2 - on_edge).norm()
            });
            let rolled = relocate(
                &polyhedron,
                &ball,
                &beyond,
                edge.faces[0],
                polyhedron.edges().iter().position(|e| e == edge).unwrap(),
                Transition::Rolling,
            );
            let found = Point::from(rolled.pose.object_from_contact.translation.vector);
            // Equation 14 turns by -beta: right where u has p on its left, as here.
            assert!((c3[0] - found).norm() < 1e-12, "{found} {c3:?}");

            // Equation 15. psi of a contact frame: turning the face's x by -psi about the normal gives the tip's x.
            let psi = |face: &Pose, contact: &ContactPose| {
                let tip_x = contact.tip_from_contact.inverse() * Vector::x();
                let along = face.inverse() * (contact.object_from_contact * tip_x);
                (-along.y).atan2(along.x)
            };
            let (psi_2, psi_3) = (psi(&p.object_from_face, &beyond), psi(&q.object_from_face, &rolled.pose));
            let unfold = UnitQuaternion::from_axis_angle(&edge.direction, -edge.exterior_angle);
            let x_q = p.object_from_face.inverse() * (unfold * (q.object_from_face * Vector::x()));
            // The x of q unfolded stands at this angle from that of p.
            let signed = x_q.y.atan2(x_q.x);
            let gap = |a: f64| (a + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
            assert!(gap(psi_3 - psi_2 - signed).abs() < 1e-9);
            let printed = x_q.x.clamp(-1.0, 1.0).acos();
            n_wrong_signs += usize::from(gap(psi_3 - psi_2 - printed).abs() > 1e-6);

            // Both transitions keep touching; sliding keeps the orientation too.
            let slid = relocate(
                &polyhedron,
                &ball,
                &beyond,
                edge.faces[0],
                polyhedron.edges().iter().position(|e| e == edge).unwrap(),
                Transition::Sliding,
            );
            assert_eq!(slid.pose.object_from_contact, rolled.pose.object_from_contact);
            assert!(slid.pose.object_from_tip().rotation.angle_to(&beyond.object_from_tip().rotation) < 1e-7);
            for contact in [rolled, slid] {
                let center = contact.pose.object_from_tip() * ball.center_in_tip;
                assert!((center - contact.center_in_object(&ball)).norm() < 1e-12);
                assert!(((center - found).norm() - ball.radius).abs() < 1e-12);
            }
            assert_eq!(rolled.pose.tip_from_contact, beyond.tip_from_contact, "equation 16");

            // With the charts of a sphere equation 15 holds for rolling alone: a tip that slides is touched elsewhere, where x
            // of its chart points elsewhere.
            let tip = ChartedSurface::sphere(
                ball.radius,
                Pose::from_parts(ball.center_in_tip.coords.into(), UnitQuaternion::identity()),
            )
            .unwrap();
            let [before, rolled, slid] = [(p, &beyond), (q, &rolled.pose), (q, &slid.pose)].map(|(face, contact)| {
                ContactPair { object: ChartedSurface::plane(face.object_from_face), tip }
                    .state_at(contact, 1e-9, 1e-6)
                    .unwrap()
            });
            assert!(gap(rolled.psi - before.psi - signed).abs() < 1e-9);
            n_sliding_off +=
                usize::from(gap(slid.psi - before.psi - signed).abs() > 1e-3 && slid.tip.axis == before.tip.axis);
        }
    }
    assert!(n_wrong_signs > 3 && n_sliding_off > 3, "{n_wrong_signs} {n_sliding_off}");
}

/// Straight over an edge both motions go the same way; the ball that goes round takes longer, by the angle over its rate.
#[test]
fn going_round_an_edge_ends_where_the_papers_jump_does_only_later() {
    let mut rng = Rng::keyed(6, "polyhedra", 0);
    for shape in [cube(), diamond()] {
        let polyhedron = Polyhedron::of(&shape).unwrap();
        for edge in polyhedron.edges() {
            let ball = any_ball(&mut rng);
            let (start, time) = approaching(&polyhedron, &ball, edge, &mut rng);
            let turn = start.pose.object_from_contact.rotation.inverse();
            let across = turn * polyhedron.faces()[edge.faces[0]].normal.cross(&edge.direction);
            for (velocity, transition) in [
                (
                    RelativeVelocity { linear: Vector::zeros(), angular: turn * -edge.direction.into_inner() },
                    Transition::Rolling,
                ),
                (RelativeVelocity::sliding(ball.radius * across.x, ball.radius * across.y), Transition::Sliding),
            ] {
                let jumped = advance_with_jumps(
                    &polyhedron,
                    &ball,
                    edge.faces[0],
                    &start.pose,
                    &velocity,
                    time + 0.2,
                    transition,
                )
                .unwrap();
                let round =
                    BallWay::of(&polyhedron, &ball, &start, &velocity, time + 0.2 + edge.exterior_angle).unwrap().end();
                assert_eq!(jumped.feature, round.feature);
                assert!(apart(&jumped.pose.object_from_tip(), &round.pose.object_from_tip(), 0.1) < 1e-8);
                assert!(apart(&jumped.pose.object_from_contact, &round.pose.object_from_contact, 0.1) < 1e-8);
            }
        }
    }
}

/// Long jumps over many faces stay on the polyhedron.
#[test]
fn jumps_end_on_faces() {
    let mut rng = Rng::keyed(7, "polyhedra", 0);
    for shape in [cube(), diamond(), any_hull(&mut rng)] {
        let (polyhedron, surface) = (Polyhedron::of(&shape).unwrap(), Surface::of(&shape).unwrap());
        for _ in 0..100 {
            let ball = any_ball(&mut rng);
            let start = any_start(&polyhedron, &ball, &mut rng);
            let Feature::Face(f) = start.feature else { panic!("it starts on a face") };
            let velocity = RelativeVelocity::rolling(rng.normal(), rng.normal());
            let end =
                advance_with_jumps(&polyhedron, &ball, f, &start.pose, &velocity, 20.0, Transition::Rolling).unwrap();
            let center = end.pose.object_from_tip() * ball.center_in_tip;
            assert!((surface.signed_distance(&center) - ball.radius).abs() < 1e-9);
            let way = ball.radius * velocity.angular.norm() * 20.0;
            assert!(way > 0.0);
        }
    }
}

#[test]
fn starts_off_the_polyhedron_are_refused() {
    let mut rng = Rng::keyed(8, "polyhedra", 0);
    let (polyhedron, ball) = (Polyhedron::of(&cube()).unwrap(), any_ball(&mut rng));
    let start = any_start(&polyhedron, &ball, &mut rng);
    let velocity = RelativeVelocity::rolling(0.3, 0.1);
    let lifted = start.pose.object_from_contact * Pose::translation(0.0, 0.0, 0.001);
    let aside = start.pose.object_from_contact * Pose::translation(0.3, 0.0, 0.0);
    let tilted = start.pose.object_from_contact * Pose::rotation(Vector::x() * 0.01);
    for object_from_contact in [lifted, aside, tilted] {
        let off = BallContact { pose: ContactPose { object_from_contact, ..start.pose }, ..start };
        let refused = BallWay::of(&polyhedron, &ball, &off, &velocity, 1.0);
        assert!(matches!(refused, Err(NoStep::NotTouching { .. })), "{refused:?}");
    }
    let opening = RelativeVelocity { linear: Vector::new(0.0, 0.0, -0.1), ..velocity };
    assert_eq!(BallWay::of(&polyhedron, &ball, &start, &opening, 1.0), Err(NoStep::NotKept { speed: -0.1 }));
    assert!(matches!(BallWay::of(&polyhedron, &ball, &start, &velocity, -1.0), Err(NoStep::Request { .. })));
    let point = Ball { radius: 0.0, ..ball };
    assert!(matches!(BallWay::of(&polyhedron, &point, &start, &velocity, 1.0), Err(NoStep::Request { .. })));
    let edge = &polyhedron.edges()[0];
    let middle = nalgebra::center(&polyhedron.vertices()[edge.ends[0]], &polyhedron.vertices()[edge.ends[1]]);
    let inside = -polyhedron.faces()[edge.faces[0]].normal;
    let odd = ball.touching(Feature::Edge(0), &middle, &inside, &UnitQuaternion::identity());
    assert_eq!(BallWay::of(&polyhedron, &ball, &odd, &velocity, 1.0), Err(NoStep::Stuck { crossings: 0 }));
    // Off by rounding is put right.
    let nearly = start.pose.object_from_contact * Pose::translation(0.0, 0.0, 1e-8);
    let nearly = BallContact { pose: ContactPose { object_from_contact: nearly, ..start.pose }, ..start };
    assert!(BallWay::of(&polyhedron, &ball, &nearly, &velocity, 1.0).is_ok());
}

#[test]
fn the_nearest_feature_is_that_of_the_surface() {
    let mut rng = Rng::keyed(9, "polyhedra", 0);
    let mut kinds = [0; 3];
    for shape in [cube(), diamond(), any_hull(&mut rng)] {
        let (polyhedron, surface) = (Polyhedron::of(&shape).unwrap(), Surface::of(&shape).unwrap());
        for _ in 0..300 {
            let ball = any_ball(&mut rng);
            let place = Vector::from(rng.direction()) * rng.uniform(0.0, 0.3);
            let object_from_tip = Pose::new(place, Vector::from(rng.direction()) * 2.0);
            let center = object_from_tip * ball.center_in_tip;
            let (foot, distance) = surface.project_signed(&center);
            let Some((contact, gap)) = ball.nearest(&polyhedron, &object_from_tip) else {
                assert!(distance <= 0.0);
                continue;
            };
            kinds[match contact.feature {
                Feature::Face(_) => 0,
                Feature::Edge(_) => 1,
                Feature::Vertex(_) => 2,
            }] += 1;
            assert!((gap + ball.radius - distance).abs() < 1e-12);
            let at = contact.pose.object_from_contact.translation.vector;
            assert!((at - foot.point_in_object.coords).norm() < 1e-12);
            let lifted = contact.pose.object_from_contact * Pose::translation(0.0, 0.0, gap);
            assert!(apart(&(lifted * contact.pose.tip_from_contact.inverse()), &object_from_tip, 0.1) < 1e-8);
            let settled = BallWay::of(&polyhedron, &ball, &contact, &RelativeVelocity::rolling(0.1, 0.2), 0.1);
            assert!(settled.is_ok(), "{settled:?}");
        }
    }
    assert!(kinds.iter().all(|&n| n > 50), "{kinds:?}");
}

/// On a face as equation 12 has it for a plane; on an edge as for a thin bar, the more so the thinner.
#[test]
fn faces_are_planes_and_edges_are_thin_bars() {
    let mut rng = Rng::keyed(10, "polyhedra", 0);
    let polyhedron = Polyhedron::of(&cube()).unwrap();
    for _ in 0..20 {
        let ball = any_ball(&mut rng);
        let place = Pose::from_parts(ball.center_in_tip.coords.into(), UnitQuaternion::identity());
        let tip = ChartedSurface::sphere(ball.radius, place).unwrap();
        let start = any_start(&polyhedron, &ball, &mut rng);
        let Feature::Face(f) = start.feature else { panic!("it starts on a face") };
        for velocity in velocities(&mut rng) {
            let end = BallWay::of(&polyhedron, &ball, &start, &velocity, 0.1).unwrap().end();
            let pair = ContactPair { object: polyhedron.chart(f), tip };
            let state = pair.state_at(&start.pose, 1e-12, 1e-7).unwrap();
            let x = start.pose.object_from_contact.inverse()
                * (pair.contact_pose(&state).object_from_contact * Vector::x());
            let by_chart = pair.advance(&state, &velocity.in_frame_turned_by(x.y.atan2(x.x)), 0.1, 1e-12).unwrap();
            if end.feature == start.feature {
                assert!(apart(&pair.object_from_tip(&by_chart), &end.pose.object_from_tip(), 0.1) < 1e-9);
            }
        }

        let e = rng.below(polyhedron.edges().len());
        let edge = &polyhedron.edges()[e];
        let middle = polyhedron.vertices()[edge.ends[0]] + edge.direction.into_inner() * (edge.length * 0.5);
        let normals = edge.faces.map(|f| polyhedron.faces()[f].normal.into_inner());
        let normal = regrasp_geometry::UnitVector::new_normalize(normals[0] + normals[1]);
        let start = ball.touching(Feature::Edge(e), &middle, &normal, &UnitQuaternion::identity());
        for velocity in velocities(&mut rng) {
            let end = BallWay::of(&polyhedron, &ball, &start, &velocity, 0.15).unwrap().end();
            if end.feature != start.feature {
                continue;
            }
            let off = [1e-4, 1e-5].map(|thickness| {
                let axis = UnitQuaternion::rotation_between(&Vector::z(), &edge.direction)
                    .unwrap_or(UnitQuaternion::from_scaled_axis(Vector::x() * std::f64::consts::PI));
                let place = Pose::from_parts((middle - normal.into_inner() * thickness).coords.into(), axis);
                let pair = ContactPair { object: ChartedSurface::cylinder(thickness, place).unwrap(), tip };
                let state = pair.state_at(&start.pose, 1e-9, 1e-7).unwrap();
                let x = start.pose.object_from_contact.inverse()
                    * (pair.contact_pose(&state).object_from_contact * Vector::x());
                let velocity = velocity.in_frame_turned_by(x.y.atan2(x.x));
                let by_chart = pair.advance(&state, &velocity, 0.15, 1e-11).unwrap();
                apart(&pair.object_from_tip(&by_chart), &end.pose.object_from_tip(), 0.1)
            });
            assert!(off[1] < 1e-5 && off[1] < 0.12 * off[0] + 1e-9, "{off:?}");
        }
    }
}
