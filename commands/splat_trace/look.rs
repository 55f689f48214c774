//! Colours and materials as the command line writes them.

use scantle::image::colour::{Srgb, from_hex};
use scantle::render::splats::Material;

/// Most objects that materials may be given for.
const MOST_OBJECTS: usize = 1 << 16;

/// `#RRGGBB`.
pub fn colour(text: &str) -> Result<Srgb, String> {
    from_hex(text).ok_or_else(|| "not #RRGGBB".to_owned())
}

/// What is said of the look of an object.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    number: usize,
    parts: Vec<Part>,
}

#[derive(Debug, Clone, PartialEq)]
enum Part {
    Named(Material),
    Colour(Srgb),
    Number(String, f64),
}

/// `N:WORD,...`, where a word is the name of a material or `NAME=VALUE`.
pub fn look(text: &str) -> Result<Look, String> {
    let (number, words) = text.split_once(':').ok_or("not N:WORD,...")?;
    let number = number.trim().parse().ok();
    let number = number.filter(|n| *n < MOST_OBJECTS);
    let number = number.ok_or("what stands before the colon is no number of an object")?;
    let parts: Result<Vec<Part>, String> = words.split(',').map(|word| part(word.trim())).collect();
    let look = Look {
        number,
        parts: parts?,
    };
    Ok(look)
}

fn part(word: &str) -> Result<Part, String> {
    let Some((name, value)) = word.split_once('=') else {
        let named = Material::NAMED.iter().find(|(name, _)| *name == word);
        let (_, material) = named.ok_or_else(|| {
            let names: Vec<_> = Material::NAMED.iter().map(|(name, _)| *name).collect();
            format!("{word} is no material; there is {}", names.join(", "))
        })?;
        return Ok(Part::Named(*material));
    };
    if name == "colour" {
        return Ok(Part::Colour(colour(value)?));
    }
    if !Material::NUMBERS.contains(&name) {
        let names = Material::NUMBERS.join(", ");
        return Err(format!("{name} is no property; there is colour, {names}"));
    }
    let number = value.parse().map_err(|_| format!("{value} is no number"))?;
    Ok(Part::Number(name.to_owned(), number))
}

/// The materials of objects by number, later words over earlier ones. A name leaves the colour.
pub fn materials(looks: &[Look]) -> Vec<Material> {
    let count = looks.iter().map(|look| look.number + 1).max();
    let mut materials = vec![Material::DEFAULT; count.unwrap_or(0)];
    for look in looks {
        let material = &mut materials[look.number];
        for part in &look.parts {
            match part {
                Part::Named(named) => {
                    let colour = material.colour;
                    *material = Material { colour, ..*named };
                }
                Part::Colour(colour) => material.colour = Some(*colour),
                Part::Number(name, value) => {
                    if let Some(number) = material.number_mut(name) {
                        *number = *value;
                    }
                }
            }
        }
    }
    materials
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_have_six_digits() {
        assert_eq!(colour("#ff8800"), Ok([255, 136, 0]));
        assert_eq!(colour("0A0b0C"), Ok([10, 11, 12]));
        for wrong in ["", "#", "#fff", "#ff880", "#ff88000", "#gg0000", "+12345"] {
            assert!(colour(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn materials_are_names_with_changes() {
        let looks = [
            "1:colour=#102030,glass,index=1.3",
            "1:mirror=0.05",
            "0:gloss",
        ];
        let looks: Vec<Look> = looks
            .iter()
            .map(|text| look(text).expect("right"))
            .collect();
        let found = materials(&looks);
        assert_eq!(found[0], Material::GLOSS);
        let wanted = Material {
            colour: Some([16, 32, 48]),
            index: 1.3,
            mirror: 0.05,
            ..Material::GLASS
        };
        assert_eq!(found[1], wanted);
        assert_eq!(materials(&[]), []);
    }

    #[test]
    fn what_is_no_material_is_refused_with_words() {
        for (text, why) in [
            ("glass", "not N:WORD,..."),
            (
                "-1:glass",
                "what stands before the colon is no number of an object",
            ),
            (
                "70000:glass",
                "what stands before the colon is no number of an object",
            ),
            (
                "0:wood",
                "wood is no material; there is clay, gloss, mirror, glass",
            ),
            (
                "0:color=1",
                "color is no property; there is colour, ambient, diffuse, specular, shininess, mirror, transparent, index",
            ),
            ("0:mirror=x", "x is no number"),
            ("0:colour=red", "not #RRGGBB"),
        ] {
            assert_eq!(look(text), Err(why.to_owned()), "{text}");
        }
        for (name, material) in Material::NAMED {
            assert_eq!(material.check(), Ok(()), "{name}");
        }
        for name in Material::NUMBERS {
            assert!(Material::DEFAULT.clone().number_mut(name).is_some());
        }
    }
}
