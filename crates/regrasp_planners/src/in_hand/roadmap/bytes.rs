//! Little-endian numbers in and out of bytes. Sections are padded with zeros to multiples of eight bytes.

/// Bytes being written.
#[derive(Debug, Default)]
pub struct Writer {
    /// So far.
    pub bytes: Vec<u8>,
}

impl Writer {
    /// One number.
    pub fn u32(&mut self, value: u32) {
        self.bytes.extend(value.to_le_bytes());
    }

    /// One number.
    pub fn u64(&mut self, value: u64) {
        self.bytes.extend(value.to_le_bytes());
    }

    /// Numbers.
    pub fn f64s(&mut self, values: impl IntoIterator<Item = f64>) {
        values.into_iter().for_each(|value| self.bytes.extend(value.to_le_bytes()));
    }

    /// Numbers.
    pub fn f32s(&mut self, values: &[f32]) {
        values.iter().for_each(|value| self.bytes.extend(value.to_le_bytes()));
    }

    /// Numbers.
    pub fn u32s(&mut self, values: impl IntoIterator<Item = u32>) {
        values.into_iter().for_each(|value| self.u32(value));
    }

    /// Zeros to the end of the section.
    pub fn pad(&mut self) {
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
    }
}

/// Bytes being read; every answer is none where the bytes end before it.
#[derive(Debug)]
pub struct Reader<'b> {
    rest: &'b [u8],
}

impl<'b> Reader<'b> {
    /// From the first of `bytes`.
    pub fn new(bytes: &'b [u8]) -> Self {
        Reader { rest: bytes }
    }

    /// The next `n` bytes.
    pub fn take(&mut self, n: usize) -> Option<&'b [u8]> {
        let (taken, rest) = self.rest.split_at_checked(n)?;
        self.rest = rest;
        Some(taken)
    }

    /// The next `n` bytes, and the zeros that pad them.
    pub fn take_padded(&mut self, n: usize) -> Option<&'b [u8]> {
        let taken = self.take(n)?;
        self.take(n.checked_next_multiple_of(8)? - n)?;
        Some(taken)
    }

    /// One number.
    pub fn u32(&mut self) -> Option<u32> {
        self.take(4)?.try_into().ok().map(u32::from_le_bytes)
    }

    /// One number.
    pub fn u64(&mut self) -> Option<u64> {
        self.take(8)?.try_into().ok().map(u64::from_le_bytes)
    }

    /// `n` numbers.
    pub fn f64s(&mut self, n: usize) -> Option<Vec<f64>> {
        let bytes = self.take(n.checked_mul(8)?)?;
        Some(bytes.as_chunks::<8>().0.iter().map(|chunk| f64::from_le_bytes(*chunk)).collect())
    }

    /// `n` numbers, padded.
    pub fn f32s(&mut self, n: usize) -> Option<Vec<f32>> {
        let bytes = self.take_padded(n.checked_mul(4)?)?;
        Some(bytes.as_chunks::<4>().0.iter().map(|chunk| f32::from_le_bytes(*chunk)).collect())
    }

    /// `n` numbers, padded.
    pub fn u32s(&mut self, n: usize) -> Option<Vec<u32>> {
        let bytes = self.take_padded(n.checked_mul(4)?)?;
        Some(bytes.as_chunks::<4>().0.iter().map(|chunk| u32::from_le_bytes(*chunk)).collect())
    }

    /// True when all was read.
    pub fn is_at_end(&self) -> bool {
        self.rest.is_empty()
    }
}

/// 64 bits of all `bytes`: finds damage, not forgery.
///
/// Four lanes take the 64-bit little-endian words in turn (the last word padded with zeros): `lane = rotate_left((lane ^
/// word) * K, 29)`. The lanes and the length are then taken in the same way by one more lane. Each step can be undone, so
/// that one changed word always changes the result.
pub fn checksum(bytes: &[u8]) -> u64 {
    let mix = |lane: u64, word: u64| (lane ^ word).wrapping_mul(MULTIPLIER).rotate_left(29);
    let mut lanes = [1u64, 2, 3, 4];
    let (blocks, rest) = bytes.as_chunks::<32>();
    for block in blocks {
        let (words, _) = block.as_chunks::<8>();
        for (lane, word) in lanes.iter_mut().zip(words) {
            *lane = mix(*lane, u64::from_le_bytes(*word));
        }
    }
    for (lane, chunk) in lanes.iter_mut().zip(rest.chunks(8)) {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        *lane = mix(*lane, u64::from_le_bytes(word));
    }
    lanes.into_iter().chain([bytes.len() as u64]).fold(0, mix)
}

/// The golden ratio's odd 64-bit multiplier (Knuth, The Art of Computer Programming 3, 6.4).
const MULTIPLIER: u64 = 0x9e37_79b9_7f4a_7c15;

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_base::Rng;

    #[test]
    fn a_checksum_sees_every_changed_bit_and_every_cut() {
        let mut rng = Rng::keyed(1, "checksum", 0);
        for length in [0, 1, 7, 8, 31, 32, 33, 100] {
            let bytes: Vec<u8> = (0..length).map(|_| rng.below(256) as u8).collect();
            let whole = checksum(&bytes);
            for bit in 0..8 * length {
                let mut damaged = bytes.clone();
                damaged[bit / 8] ^= 1 << (bit % 8);
                assert_ne!(checksum(&damaged), whole, "bit {bit} of {length} bytes");
            }
            for cut in 0..length {
                assert_ne!(checksum(&bytes[..cut]), whole, "{cut} of {length} bytes");
            }
        }
    }

    #[test]
    fn a_reader_never_reads_past_the_end() {
        let mut reader = Reader::new(&[1, 0, 0, 0, 9]);
        assert_eq!(reader.u32(), Some(1));
        assert_eq!((reader.u32(), reader.f64s(usize::MAX), reader.f32s(1)), (None, None, None));
        assert_eq!(reader.take(1), Some([9].as_slice()));
        assert!(reader.is_at_end());
    }
}
