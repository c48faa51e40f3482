//! PNG files.

use super::shade::Picture;

/// Bytes of a PNG file with 8 bits per channel.
///
/// Panics if the picture has not three bytes per pixel.
pub fn encode(picture: &Picture) -> Vec<u8> {
    assert_eq!(picture.rgb.len(), 3 * picture.width * picture.height, "three bytes per pixel");
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.width as u32, picture.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder.set_filter(png::Filter::Adaptive);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header().expect("memory takes bytes");
    writer.write_image_data(&picture.rgb).expect("the size was asserted above");
    writer.finish().expect("memory takes bytes");
    bytes
}
