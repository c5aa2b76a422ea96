//! Pictures in files: SVG as it is, or PNG made of it.

use std::path::Path;
use std::sync::Arc;

use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::fontdb::Database;
use resvg::usvg::{Options, Tree};
use thiserror::Error;

/// Why there is no picture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The SVG is none.
    #[error("the picture cannot be made: {0}")]
    Svg(#[from] resvg::usvg::Error),
    /// It would have no pixel, or too many.
    #[error("a picture of {width} by {height} pixels cannot be made")]
    Size {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
    },
    /// The encoder failed.
    #[error("the picture cannot be encoded: {0}")]
    Encoding(String),
}

/// Pixels for a unit of the SVG: fine enough to be printed.
const SCALE: f32 = 2.0;

/// The octets of a picture for a file: PNG if its name ends in `.png`, the SVG itself otherwise.
///
/// # Errors
///
/// [`PictureError`].
pub fn for_file(path: &Path, svg: &str) -> Result<Vec<u8>, PictureError> {
    let is_png = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
    if is_png { png(svg) } else { Ok(svg.as_bytes().to_vec()) }
}

/// An SVG document as PNG, two pixels for each of its units, on white. Its texts are set in a font that comes along, so that the picture is
/// the same everywhere.
///
/// # Errors
///
/// [`PictureError`].
pub fn png(svg: &str) -> Result<Vec<u8>, PictureError> {
    let mut fonts = Database::new();
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    let family = fonts
        .faces()
        .next()
        .and_then(|face| face.families.first())
        .map(|(name, _)| name.clone())
        .unwrap_or_default();
    fonts.set_sans_serif_family(family.clone());
    let options = Options {
        fontdb: Arc::new(fonts),
        font_family: family,
        ..Options::default()
    };
    let tree = Tree::from_str(svg, &options)?;
    let size = tree.size();
    let [width, height] = [size.width(), size.height()].map(|length| (length * SCALE).ceil() as u32);
    let mut pixels = Pixmap::new(width, height).ok_or(PictureError::Size { width, height })?;
    pixels.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut pixels.as_mut());
    pixels
        .encode_png()
        .map_err(|error| PictureError::Encoding(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SVG: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" width="200" height="100"><text x="20" y="60" font-family="sans-serif" font-size="40">Nm</text></svg>"#;

    /// Darkest pixel in part of a picture, 0…255.
    fn darkest(png: &[u8], columns: std::ops::Range<u32>) -> u8 {
        let pixels = Pixmap::decode_png(png).expect("a PNG");
        assert_eq!((pixels.width(), pixels.height()), (400, 200));
        let columns = columns.flat_map(|x| (0..200).map(move |y| (x, y)));
        columns
            .filter_map(|(x, y)| pixels.pixel(x, y))
            .map(|pixel| pixel.red())
            .min()
            .unwrap_or(255)
    }

    #[test]
    fn texts_are_drawn_without_a_font_of_the_system() {
        let picture = png(SVG).expect("it can be drawn");
        assert!(darkest(&picture, 40..200) < 100, "letters");
        assert_eq!(darkest(&picture, 350..400), 255, "white beside them");
        assert_eq!(png(SVG).expect("it can be drawn"), picture, "the same octets again");
    }

    #[test]
    fn the_name_of_the_file_decides() {
        let octets = |name: &str| for_file(Path::new(name), SVG).expect("it can be drawn");
        assert!(octets("a.PNG").starts_with(&[0x89, b'P', b'N', b'G']));
        assert_eq!(octets("a.svg"), SVG.as_bytes());
    }

    #[test]
    fn what_is_no_svg_is_told() {
        assert!(png("<html>").is_err());
    }
}
