//! Contacts, cones, forces and paths as things in space.

use crate::render::{Paint, PlacedSurface, Surface};
use crate::story::tessellate::tessellate;
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_geometry::{Point, Pose, Shape, UnitVector};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Steps around round marks.
const AROUND: usize = 32;

/// A solid made by turning `profile` (distance from the axis, height) about the line from `base` along `axis`.
fn turned(profile: &[[f64; 2]], base: &Point, axis: &UnitVector, color: [f64; 3], body: u32) -> PlacedSurface {
    let (along, across) = regrasp_geometry::frame::tangents(axis);
    let at = |[distance, height]: [f64; 2], k: usize| {
        let angle = TAU * (k % AROUND) as f64 / AROUND as f64;
        let out = along.into_inner() * libm::cos(angle) + across.into_inner() * libm::sin(angle);
        (base + axis.into_inner() * height + out * distance, out)
    };
    let (mut corners, mut normals) = (Vec::new(), Vec::new());
    for pair in profile.windows(2) {
        let (run, rise) = (pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]);
        for k in 0..AROUND {
            let [(a, out_a), (b, out_b)] = [at(pair[0], k), at(pair[0], k + 1)];
            let [(c, _), (d, _)] = [at(pair[1], k + 1), at(pair[1], k)];
            let [from, to] =
                [out_a, out_b].map(|out| (out * rise - axis.into_inner() * run).try_normalize(0.0).unwrap_or(out));
            if pair[0][0] > 0.0 {
                corners.push([a, b, c]);
                normals.push([from, to, to]);
            }
            if pair[1][0] > 0.0 {
                corners.push([a, c, d]);
                normals.push([from, to, from]);
            }
        }
    }
    let surface = Arc::new(Surface { corners, normals });
    PlacedSurface { world_from_surface: Pose::identity(), surface, paint: Paint::Plain(color), body }
}

/// A flat disc at a contact.
pub fn disc(center: &Point, normal: &UnitVector, radius: f64, color: [f64; 3], body: u32) -> PlacedSurface {
    let half = 0.06 * radius;
    turned(&[[0.0, -half], [radius, -half], [radius, half], [0.0, half]], center, normal, color, body)
}

/// A rod from one point to another; nothing where they coincide.
pub fn rod(from: &Point, to: &Point, radius: f64, color: [f64; 3], body: u32) -> Option<PlacedSurface> {
    let axis = UnitVector::try_new(to - from, 1e-12)?;
    let length = (to - from).norm();
    Some(turned(&[[0.0, 0.0], [radius, 0.0], [radius, length], [0.0, length]], from, &axis, color, body))
}

/// An arrow from one point to another; nothing where they coincide.
pub fn arrow(from: &Point, to: &Point, radius: f64, color: [f64; 3], body: u32) -> Option<PlacedSurface> {
    let axis = UnitVector::try_new(to - from, 1e-12)?;
    let length = (to - from).norm();
    let neck = (length - 4.5 * radius).max(0.4 * length);
    let profile = [[0.0, 0.0], [radius, 0.0], [radius, neck], [2.4 * radius, neck], [0.0, length]];
    Some(turned(&profile, from, &axis, color, body))
}

/// The mantle of a cone with its apex at a contact, open outward.
pub fn cone(apex: &Point, axis: &UnitVector, height: f64, radius: f64, color: [f64; 3], body: u32) -> PlacedSurface {
    turned(&[[0.0, 0.0], [radius, height]], apex, axis, color, body)
}

/// A rope along `points`.
pub fn rope(points: &[Point], radius: f64, color: [f64; 3], body: u32) -> Vec<PlacedSurface> {
    let ball = Arc::new(Surface::of(&tessellate(&Shape::Sphere { radius })));
    let mut models: Vec<PlacedSurface> =
        points.windows(2).filter_map(|pair| rod(&pair[0], &pair[1], radius, color, body)).collect();
    models.extend(points.iter().map(|point| PlacedSurface {
        world_from_surface: Pose::from_parts(Translation3::from(point.coords), UnitQuaternion::identity()),
        surface: Arc::clone(&ball),
        paint: Paint::Plain(color),
        body,
    }));
    models
}
