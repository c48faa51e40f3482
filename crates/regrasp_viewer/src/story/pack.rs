//! Numbers of meshes as text: 16-bit coordinates within bounds, and base64 (RFC 4648, section 4).

use super::MeshStory;
use regrasp_geometry::Point;

const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
/// Steps of a coordinate.
const STEPS: f64 = 65535.0;
/// Most vertices that 16-bit indices tell apart.
const MAX_SHORT: usize = 65536;

/// A mesh as text. Every coordinate is off by at most half of a 65535th of the extent along its axis.
///
/// Panics if there is no vertex.
pub fn pack(vertices: &[Point], triangles: &[[u32; 3]], smooth_below: f64) -> MeshStory {
    let (lower, upper) = vertices.iter().fold((vertices[0], vertices[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    let mut bytes = Vec::with_capacity(6 * vertices.len());
    for vertex in vertices {
        for k in 0..3 {
            let extent = upper[k] - lower[k];
            let share = if extent > 0.0 { (vertex[k] - lower[k]) / extent } else { 0.0 };
            bytes.extend(((share * STEPS).round() as u16).to_le_bytes());
        }
    }
    let mut indices = Vec::with_capacity(6 * triangles.len());
    for &index in triangles.iter().flatten() {
        if vertices.len() <= MAX_SHORT {
            indices.extend((index as u16).to_le_bytes());
        } else {
            indices.extend(index.to_le_bytes());
        }
    }
    MeshStory {
        vertices: base64(&bytes),
        lower: lower.coords.into(),
        upper: upper.coords.into(),
        triangles: base64(&indices),
        smooth_below,
    }
}

/// Vertices and triangles of a packed mesh; none when it contradicts itself.
pub fn unpack(mesh: &MeshStory) -> Option<(Vec<Point>, Vec<[u32; 3]>)> {
    let bytes = from_base64(&mesh.vertices)?;
    if !bytes.len().is_multiple_of(6) {
        return None;
    }
    let value = |pair: &[u8]| f64::from(u16::from_le_bytes([pair[0], pair[1]])) / STEPS;
    let vertices: Vec<Point> = bytes
        .chunks_exact(6)
        .map(|six| {
            let at = |k: usize| mesh.lower[k] + (mesh.upper[k] - mesh.lower[k]) * value(&six[2 * k..2 * k + 2]);
            Point::new(at(0), at(1), at(2))
        })
        .collect();
    let bytes = from_base64(&mesh.triangles)?;
    let indices: Vec<u32> = if vertices.len() <= MAX_SHORT {
        bytes.chunks_exact(2).map(|b| u32::from(u16::from_le_bytes([b[0], b[1]]))).collect()
    } else {
        bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
    };
    let is_sound = indices.len().is_multiple_of(3) && indices.iter().all(|&i| (i as usize) < vertices.len());
    is_sound.then(|| (vertices, indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect()))
}

/// `bytes` in base64, padded.
pub fn base64(bytes: &[u8]) -> String {
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let byte = |k: usize| u32::from(three.get(k).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for k in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * k) & 63) as usize];
            out.push(if k <= three.len() { letter as char } else { '=' });
        }
    }
    out
}

/// The bytes of padded base64; none when it is not that.
pub fn from_base64(text: &str) -> Option<Vec<u8>> {
    let text = text.as_bytes();
    if !text.len().is_multiple_of(4) {
        return None;
    }
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    for four in text.chunks_exact(4) {
        let n_padding = four.iter().rev().take_while(|&&letter| letter == b'=').count();
        if n_padding > 2 {
            return None;
        }
        let mut word = 0;
        for &letter in &four[..4 - n_padding] {
            word = word << 6 | LETTERS.iter().position(|&known| known == letter)? as u32;
        }
        word <<= 6 * n_padding;
        out.extend(&word.to_be_bytes()[1..4 - n_padding]);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn base64_is_that_of_the_standard() {
        // RFC 4648, section 10.
        let known = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        for (n, text) in known.into_iter().enumerate() {
            assert_eq!(base64(&b"foobar"[..n]), text);
            assert_eq!(from_base64(text).unwrap(), &b"foobar"[..n]);
        }
        for bad in ["A", "A===", "====", "Zm9v!mFy", "Zm=v"] {
            assert_eq!(from_base64(bad), None, "{bad}");
        }
    }

    #[test]
    fn packed_meshes_come_back_within_half_a_step() {
        let mut rng = Rng::keyed(1, "pack", 0);
        for n in [3, 500, MAX_SHORT, MAX_SHORT + 1] {
            let mut vertices: Vec<Point> =
                (0..n).map(|_| Point::new(rng.uniform(-0.1, 0.3), rng.uniform(1.0, 1.001), 0.25)).collect();
            vertices[1] = vertices[0];
            let triangles = vec![[0, 1, n as u32 - 1], [2, 1, 0]];
            let mesh = pack(&vertices, &triangles, 0.5);
            let (found, indices) = unpack(&mesh).unwrap();
            assert_eq!(indices, triangles);
            assert_eq!(found.len(), n);
            for (exact, found) in vertices.iter().zip(&found) {
                for k in 0..3 {
                    let bound = 0.5 * (mesh.upper[k] - mesh.lower[k]) / STEPS + 1e-15;
                    assert!((exact[k] - found[k]).abs() <= bound, "{exact} {found}");
                }
            }
        }
    }
}
