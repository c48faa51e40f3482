//! Light, shadow, outlines and layers.

use super::camera::Camera;
use super::model::{PlacedSurface, mixed};
use super::raster::{NONE, Samples};
use regrasp_geometry::{Point, Vector};
use std::f64::consts::{PI, TAU};

/// How a picture is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// Samples per pixel, along each side.
    pub supersampling: usize,
    /// What is nearer than this to a surface darkens it, in metres.
    pub occlusion_radius: f64,
    /// Ball that holds what casts shadows, in the world; none: no shadows.
    pub shadows_within: Option<(Point, f64)>,
    /// Width of outlines, in pixels.
    pub outline: f64,
}

/// Models that are drawn over the solid ones.
#[derive(Debug, Clone)]
pub struct Layer {
    /// What is in it; of these only the nearest shows.
    pub models: Vec<PlacedSurface>,
    /// Opacity where nothing solid is in front.
    pub in_front: f64,
    /// Opacity where it is hidden behind something solid.
    pub hidden: f64,
    /// Whether the camera has to show all of it.
    pub is_framed: bool,
}

/// A picture: red, green and blue of each pixel, row by row from the upper left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Three bytes per pixel, sRGB.
    pub rgb: Vec<u8>,
}

/// Samples along each side of the picture that the light sees.
const SHADOW_SIZE: usize = 1400;
/// Shares of light: from above everywhere, from the key light, from the fill light.
const AMBIENT: f64 = 0.50;
const KEY: f64 = 0.62;
const FILL: f64 = 0.20;
/// Directions in which a surface looks for what is near.
const N_OCCLUSION: usize = 14;
/// Sets of such directions, each turned against the last.
const N_TURNS: usize = 16;
/// Share of the light that outlines leave.
const OUTLINE_LIGHT: f64 = 0.12;

/// What `camera` sees of `solid`, with `layers` over it, on white. `camera` is for a picture of `width` times `height` pixels.
pub fn render(
    solid: &[PlacedSurface],
    layers: &[Layer],
    camera: &Camera,
    width: usize,
    height: usize,
    look: &Look,
) -> Picture {
    let n = look.supersampling.max(1);
    let fine = camera.scaled(n as f64);
    let light = Light::new(solid, camera, look);
    let base = Shaded::new(solid, &fine, width * n, height * n);
    let over: Vec<Shaded> = layers.iter().map(|l| Shaded::new(&l.models, &fine, width * n, height * n)).collect();
    let mut rgb = Vec::with_capacity(3 * width * height);
    for row in 0..height {
        for column in 0..width {
            let mut sum = [0.0; 3];
            for k in 0..n * n {
                let (x, y) = (column * n + k % n, row * n + k / n);
                let color = composed(&base, &over, layers, x, y, &light, look);
                (0..3).for_each(|c| sum[c] += color[c]);
            }
            rgb.extend(sum.map(|value| to_byte(value / (n * n) as f64)));
        }
    }
    Picture { width, height, rgb }
}

/// Colour of one sample, all layers included.
fn composed(
    base: &Shaded,
    over: &[Shaded],
    layers: &[Layer],
    x: usize,
    y: usize,
    light: &Light,
    look: &Look,
) -> [f64; 3] {
    let solid_at = base.inverse_depth(x, y);
    let mut color = base.color(x, y, light, look).unwrap_or([1.0; 3]);
    let mut present: Vec<(f64, usize)> =
        over.iter().enumerate().map(|(i, layer)| (layer.inverse_depth(x, y), i)).filter(|(at, _)| *at > 0.0).collect();
    // Farthest first; at one depth in the order of the layers.
    present.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    for (at, i) in present {
        let opacity = if at >= solid_at { layers[i].in_front } else { layers[i].hidden };
        if opacity > 0.0
            && let Some(own) = over[i].color(x, y, light, look)
        {
            color = mixed(color, own, opacity);
        }
    }
    color
}

fn to_byte(linear: f64) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let value = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 };
    (value * 255.0).round() as u8
}

/// Two lights, and what the first one sees.
struct Light {
    /// Unit vectors to the lights.
    key: Vector,
    fill: Vector,
    /// Half-way between the key light and the eye.
    half_way: Vector,
    shadow: Option<(Camera, Samples, f64)>,
    /// Where surfaces look for what is near.
    occlusion: Vec<[[f64; 4]; N_OCCLUSION]>,
}

/// Directions over a surface (along it, across, outward), and how far to look, as a share of the farthest. Even over the half
/// space by the area of its shadow on the surface.
fn occlusion_directions(turn: usize) -> [[f64; 4]; N_OCCLUSION] {
    std::array::from_fn(|k| {
        let share = (k as f64 + 0.5) / N_OCCLUSION as f64;
        let angle = TAU * turn as f64 / N_TURNS as f64 + k as f64 * PI * (3.0 - 5f64.sqrt());
        let width = share.sqrt();
        let reach = 0.25 + 0.75 * ((k * 7) % N_OCCLUSION) as f64 / N_OCCLUSION as f64;
        [libm::cos(angle) * width, libm::sin(angle) * width, (1.0 - share).sqrt(), reach]
    })
}

impl Light {
    fn new(solid: &[PlacedSurface], camera: &Camera, look: &Look) -> Self {
        let in_world = |v: Vector| camera.axes.transpose() * v.normalize();
        let key = in_world(Vector::new(-0.45, 0.85, -0.75));
        let shadow = look.shadows_within.map(|(center, radius)| {
            let distance = 60.0 * radius;
            let half = SHADOW_SIZE as f64 / 2.0;
            let eye = Camera::looking(&-key, &center, distance, half * distance / radius, [half, half]);
            let seen = Samples::of(solid, &eye, SHADOW_SIZE, SHADOW_SIZE);
            (eye, seen, radius)
        });
        let half_way = (key - camera.forward()).normalize();
        let fill = in_world(Vector::new(0.9, 0.15, -0.6));
        let occlusion = (0..N_TURNS).map(occlusion_directions).collect();
        Light { key, fill, half_way, shadow, occlusion }
    }

    /// Share of the key light that reaches a point with this normal.
    fn reaches(&self, point: &Point, normal: &Vector) -> f64 {
        let Some((eye, seen, radius)) = &self.shadow else { return 1.0 };
        let at = eye.see(&(point + normal * (0.008 * radius)));
        let nearest = 1.0 / (at.depth - 0.004 * radius);
        let mut lit = 0;
        for step in 0..16 {
            let (x, y) = (at.x + 1.8 * (f64::from(step % 4) - 1.5), at.y + 1.8 * (f64::from(step / 4) - 1.5));
            let inside = x >= 0.0 && y >= 0.0 && x < seen.width as f64 && y < seen.height as f64;
            lit += i32::from(!inside || seen.inverse_depth[y as usize * seen.width + x as usize] <= nearest);
        }
        f64::from(lit) / 16.0
    }
}

struct WorldTriangle {
    corners: [Point; 3],
    normals: [Vector; 3],
    model: usize,
    number: usize,
}

/// Models with what is seen of them.
struct Shaded<'m> {
    models: &'m [PlacedSurface],
    camera: &'m Camera,
    triangles: Vec<WorldTriangle>,
    seen: Samples,
}

impl<'m> Shaded<'m> {
    fn new(models: &'m [PlacedSurface], camera: &'m Camera, width: usize, height: usize) -> Self {
        let triangles = models.iter().enumerate().flat_map(|(m, model)| {
            let rotation = *model.world_from_surface.rotation.to_rotation_matrix().matrix();
            model.world_corners().enumerate().map(move |(number, corners)| {
                let normals = model.surface.normals[number].map(|n| rotation * n);
                WorldTriangle { corners, normals, model: m, number }
            })
        });
        Shaded { models, camera, triangles: triangles.collect(), seen: Samples::of(models, camera, width, height) }
    }

    fn inverse_depth(&self, x: usize, y: usize) -> f64 {
        self.seen.inverse_depth[y * self.seen.width + x]
    }

    /// The triangle seen at a sample.
    fn triangle(&self, x: usize, y: usize) -> Option<&WorldTriangle> {
        match self.seen.triangle[y * self.seen.width + x] {
            NONE => None,
            number => Some(&self.triangles[number as usize]),
        }
    }

    /// Light that comes from a sample; none where nothing is seen.
    fn color(&self, x: usize, y: usize, light: &Light, look: &Look) -> Option<[f64; 3]> {
        let triangle = self.triangle(x, y)?;
        let ray = self.camera.ray(x as f64 + 0.5, y as f64 + 0.5);
        let weights = weights_on(triangle, &self.camera.eye, &ray);
        let mix = |v: &[Vector; 3]| v[0] * weights[0] + v[1] * weights[1] + v[2] * weights[2];
        let point = Point::from(mix(&triangle.corners.map(|p| p.coords)));
        let mut normal = mix(&triangle.normals).try_normalize(1e-12).unwrap_or_else(|| -ray.normalize());
        if normal.dot(&ray) > 0.0 {
            normal = -normal;
        }
        let model = &self.models[triangle.model];
        let local = Point::from(mix(&model.surface.corners[triangle.number].map(|p| p.coords)));
        let albedo = model.paint.at(&local);
        let open = self.openness(&point, &normal, x, y, light, look);
        let facing = light.key.dot(&normal).max(0.0);
        let key = if facing > 0.0 { facing * light.reaches(&point, &normal) } else { 0.0 };
        let ambient = AMBIENT * (0.75 + 0.25 * normal.z) * open;
        let diffuse = ambient + KEY * key + FILL * light.fill.dot(&normal).max(0.0) * (0.4 + 0.6 * open);
        let shine =
            if key > 0.0 { 0.10 * libm::pow(light.half_way.dot(&normal).max(0.0), 40.0) * (key / facing) } else { 0.0 };
        let outline = if self.is_outline(x, y, look) { OUTLINE_LIGHT } else { 1.0 };
        Some(albedo.map(|a| (a * diffuse + shine) * outline))
    }

    /// Share of the half space over a surface in which nothing is near, as far as the picture knows.
    fn openness(&self, point: &Point, normal: &Vector, x: usize, y: usize, light: &Light, look: &Look) -> f64 {
        if look.occlusion_radius <= 0.0 {
            return 1.0;
        }
        let (along, across) = regrasp_geometry::frame::tangents(&regrasp_geometry::UnitVector::new_unchecked(*normal));
        let mut hidden = 0.0;
        // Neighbouring samples look in other directions, and a pixel takes their mean.
        for [x, y, z, share] in &light.occlusion[(x * 5 + y * 11) % N_TURNS] {
            let direction = along.into_inner() * *x + across.into_inner() * *y + normal * *z;
            let reach = look.occlusion_radius * share;
            let there = self.camera.see(&(point + direction * reach));
            let inside = there.x >= 0.0
                && there.y >= 0.0
                && there.x < self.seen.width as f64
                && there.y < self.seen.height as f64;
            if !inside || there.depth <= 0.0 {
                continue;
            }
            let at = self.inverse_depth(there.x as usize, there.y as usize);
            let before = there.depth - 1.0 / at;
            if at > 0.0 && before > 0.03 * look.occlusion_radius && before < 2.0 * look.occlusion_radius {
                hidden += 1.0;
            }
        }
        1.0 - 0.85 * hidden / N_OCCLUSION as f64
    }

    /// True where another body, or the background, begins near by and farther away, or a surface folds sharply.
    fn is_outline(&self, x: usize, y: usize, look: &Look) -> bool {
        let reach = (look.outline * look.supersampling as f64 / 2.0).round() as isize;
        let Some(own) = self.triangle(x, y) else { return false };
        if reach < 1 {
            return false;
        }
        let depth = 1.0 / self.inverse_depth(x, y);
        let slant = (reach as f64 * 0.7).round() as isize;
        let steps = [(reach, 0), (-reach, 0), (0, reach), (0, -reach)];
        let slants = [(slant, slant), (slant, -slant), (-slant, slant), (-slant, -slant)];
        steps.into_iter().chain(slants).any(|(dx, dy)| {
            let (Some(column), Some(row)) = (x.checked_add_signed(dx), y.checked_add_signed(dy)) else { return false };
            if column >= self.seen.width || row >= self.seen.height {
                return false;
            }
            let Some(other) = self.triangle(column, row) else { return true };
            let beyond = 1.0 / self.inverse_depth(column, row) - depth;
            let jump = look.occlusion_radius.max(1e-3) * 0.3;
            let other_body = self.models[own.model].body != self.models[other.model].body;
            let folds = own.normals[0].dot(&other.normals[0]) < 0.6 && other_body;
            (other_body && beyond > 0.0 && (beyond > 0.1 * jump || folds)) || beyond > jump
        })
    }
}

/// Barycentric coordinates of where the ray from `eye` meets the triangle's plane.
fn weights_on(triangle: &WorldTriangle, eye: &Point, ray: &Vector) -> [f64; 3] {
    let [a, b, c] = triangle.corners;
    let (ab, ac) = (b - a, c - a);
    let across = ray.cross(&ac);
    let determinant = ab.dot(&across);
    if determinant.abs() < 1e-30 {
        return [1.0 / 3.0; 3];
    }
    let from_a = eye - a;
    let u = from_a.dot(&across) / determinant;
    let v = ray.dot(&from_a.cross(&ab)) / determinant;
    // Corners were rounded to a part of a sample, so the ray may pass just beside.
    let (u, v) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
    let (u, v) = if u + v > 1.0 { (u / (u + v), v / (u + v)) } else { (u, v) };
    [1.0 - u - v, u, v]
}
