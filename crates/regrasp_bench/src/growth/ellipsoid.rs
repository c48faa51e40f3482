//! One ellipsoid in any even number of triangles, as binary STL.

use std::f64::consts::{PI, TAU};

/// Bytes of a binary STL file of the ellipsoid about the origin with half axes `radii`, in metres, in `n_triangles`.
///
/// The surface is closed, its corners lie on the ellipsoid and its triangles are nearly even on the unit sphere.
/// Panics if the number is odd or below 6: no such surface has it.
pub fn stl(radii: [f64; 3], n_triangles: usize) -> Vec<u8> {
    let triangles = triangles(n_triangles);
    let mut bytes = vec![0u8; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        // Normals are not used by any reader that looks at the winding; zero means "see the corners".
        bytes.extend([0u8; 12]);
        for corner in corners {
            for axis in 0..3 {
                bytes.extend(((radii[axis] * corner[axis]) as f32).to_le_bytes());
            }
        }
        bytes.extend([0u8; 2]);
    }
    bytes
}

/// Triangles of the unit sphere, counterclockwise as seen from outside.
///
/// Rings at equal steps of colatitude between two poles. A strip between rings of a and b corners has a + b triangles, so
/// there are twice as many triangles as corners on rings.
fn triangles(n_triangles: usize) -> Vec<[[f64; 3]; 3]> {
    let sizes = ring_sizes(n_triangles);
    let mut rings: Vec<Ring> = vec![Ring { colatitude: 0.0, n: 1, shift: 0.0 }];
    let step = PI / (sizes.len() + 1) as f64;
    rings.extend(sizes.iter().enumerate().map(|(index, &n)| Ring {
        colatitude: step * (index + 1) as f64,
        n,
        shift: if index % 2 == 0 { 0.0 } else { 0.5 },
    }));
    rings.push(Ring { colatitude: PI, n: 1, shift: 0.0 });
    let mut found = Vec::with_capacity(n_triangles);
    for pair in rings.windows(2) {
        strip(&pair[0], &pair[1], &mut found);
    }
    found
}

/// Corners of the rings from pole to pole, in proportion to their circumference: half of `n_triangles` in all.
fn ring_sizes(n_triangles: usize) -> Vec<usize> {
    assert!(n_triangles >= 6 && n_triangles.is_multiple_of(2), "{n_triangles} triangles close no such surface");
    let n_corners = n_triangles / 2;
    // So many rings that triangles are about equilateral: rings of sqrt(3) (k + 1) sin(colatitude) corners.
    let n_rings = ((n_corners as f64 * PI / 12f64.sqrt()).sqrt().round() as usize).max(2) - 1;
    let weights: Vec<f64> = (1..=n_rings).map(|ring| (PI * ring as f64 / (n_rings + 1) as f64).sin()).collect();
    let total: f64 = weights.iter().sum();
    // Rounding the running sum keeps the total.
    let (mut sum, mut done) = (0.0, 0);
    weights
        .iter()
        .map(|weight| {
            sum += weight;
            let upto = (n_corners as f64 * sum / total).round() as usize;
            let own = upto - done;
            done = upto;
            own
        })
        .collect()
}

/// Corners at one colatitude, evenly spaced; a pole is a ring of one.
struct Ring {
    colatitude: f64,
    n: usize,
    /// Turn of the first corner about z, in steps between corners.
    shift: f64,
}

impl Ring {
    fn angle(&self, index: usize) -> f64 {
        TAU * (index as f64 + self.shift) / self.n as f64
    }

    fn corner(&self, index: usize) -> [f64; 3] {
        let (sin, cos) = self.colatitude.sin_cos();
        if self.n == 1 {
            return [0.0, 0.0, cos];
        }
        let angle = self.angle(index % self.n);
        [sin * angle.cos(), sin * angle.sin(), cos]
    }
}

/// The triangles between two rings: always on with the ring whose next corner comes first.
fn strip(upper: &Ring, lower: &Ring, found: &mut Vec<[[f64; 3]; 3]>) {
    let (n_upper, n_lower) = (if upper.n == 1 { 0 } else { upper.n }, if lower.n == 1 { 0 } else { lower.n });
    let (mut above, mut below) = (0, 0);
    while above < n_upper || below < n_lower {
        let is_upper = below == n_lower || (above < n_upper && upper.angle(above + 1) < lower.angle(below + 1));
        if is_upper {
            found.push([upper.corner(above), lower.corner(below), upper.corner(above + 1)]);
            above += 1;
        } else {
            found.push([upper.corner(above), lower.corner(below), lower.corner(below + 1)]);
            below += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Corners as the file has them.
    fn read(bytes: &[u8]) -> Vec<[[f32; 3]; 3]> {
        let n = u32::from_le_bytes(bytes[80..84].try_into().unwrap()) as usize;
        assert_eq!(bytes.len(), 84 + 50 * n);
        let number = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let record =
            |i: usize| std::array::from_fn(|c| std::array::from_fn(|k| number(84 + 50 * i + 12 + 12 * c + 4 * k)));
        (0..n).map(record).collect()
    }

    #[test]
    fn every_size_has_its_triangles_and_every_edge_two_of_them() {
        for n in [6, 8, 10, 12, 14, 50, 100, 102, 1_000, 10_000] {
            let triangles = read(&stl([0.030, 0.028, 0.034], n));
            assert_eq!(triangles.len(), n);
            let bits = |corner: [f32; 3]| corner.map(f32::to_bits);
            let mut edges = BTreeMap::new();
            for t in &triangles {
                for k in 0..3 {
                    *edges.entry((bits(t[k]), bits(t[(k + 1) % 3]))).or_insert(0) += 1;
                }
            }
            for (&(from, to), &count) in &edges {
                assert!(count == 1 && edges.contains_key(&(to, from)), "{n}: {count} times one way");
            }
            // Euler: edges are three halves of the triangles, and a sphere has V - E + F = 2.
            let corners: std::collections::BTreeSet<_> = triangles.iter().flatten().map(|&c| bits(c)).collect();
            assert_eq!((edges.len() / 2, corners.len()), (3 * n / 2, n / 2 + 2));
        }
    }

    #[test]
    fn the_volume_tends_to_the_closed_form_and_the_winding_is_outward() {
        let radii = [0.030, 0.028, 0.034];
        let exact = 4.0 / 3.0 * PI * radii.iter().product::<f64>();
        for n in [100, 1_000, 10_000, 100_000] {
            let volume: f64 = read(&stl(radii, n))
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|corner| corner.map(f64::from));
                    let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
                    (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0
                })
                .sum();
            let missing = 1.0 - volume / exact;
            // Over an equilateral triangle of side a the unit sphere stands a^2 / 8 high on average.
            let even = 12f64.sqrt() * PI / n as f64;
            assert!(missing > 0.9 * even && missing < 1.3 * even, "{n}: {missing}, not {even}");
        }
    }

    #[test]
    fn no_triangle_is_a_sliver() {
        for n in [100, 1_000, 10_000, 100_000] {
            for corners in triangles(n) {
                let length =
                    |i: usize, j: usize| (0..3).map(|k| (corners[i][k] - corners[j][k]).powi(2)).sum::<f64>().sqrt();
                let sides = [length(0, 1), length(1, 2), length(2, 0)];
                let (shortest, longest) =
                    (sides.iter().copied().fold(9.0, f64::min), sides.iter().copied().fold(0.0, f64::max));
                assert!(longest < 2.5 * shortest, "{n}: {sides:?}");
            }
        }
    }
}
