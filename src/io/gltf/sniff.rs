//! Telling a glTF document from other JSON.

use super::document::Asset;
use serde::Deserializer as _;
use serde::de::{Error, IgnoredAny, MapAccess, Visitor};
use std::borrow::Cow;
use std::fmt;

/// Whether a text is the JSON of a glTF file: an object with the member `asset` that the format
/// requires, which in turn has a version.
///
/// A text that breaks off or goes wrong after that member is one all the same. Cost: linear in the
/// bytes up to there, without holding them.
pub fn is_document(text: &[u8]) -> bool {
    let mut found = false;
    let mut parser = serde_json::Deserializer::from_slice(text);
    // The answer is `found`: the search ends with an error, be it that there is nothing to add.
    let _ = parser.deserialize_map(Search { found: &mut found });
    found
}

/// Looks for the member among those of the outermost object.
struct Search<'f> {
    found: &'f mut bool,
}

impl<'de> Visitor<'de> for Search<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<(), A::Error> {
        while let Some(key) = members.next_key::<Cow<str>>()? {
            if key == "asset" {
                members.next_value::<Asset>()?;
                *self.found = true;
                return Err(A::Error::custom("found"));
            }
            members.next_value::<IgnoredAny>()?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::is_document;

    #[test]
    fn the_asset_makes_the_difference() {
        for (text, is_gltf) in [
            (r#"{"asset": {"version": "2.0"}}"#, true),
            (
                r#"{"scene": 0, "asset": {"generator": "x", "version": "2.0"}, "#,
                true,
            ),
            (
                r#"{"nodes": [{"a": [1, {}]}], "asset": {"version": "1.0"}} x"#,
                true,
            ),
            (r#"{"asset": {"version": 2}}"#, false),
            (r#"{"asset": "a.obj"}"#, false),
            (r#"{"result": {"asset": {"version": "2.0"}}}"#, false),
            (
                r#"{"schema": 1, "scantle": "0.1.0", "command": "info"}"#,
                false,
            ),
            (r#"[{"asset": {"version": "2.0"}}]"#, false),
            ("{", false),
            ("", false),
        ] {
            assert_eq!(is_document(text.as_bytes()), is_gltf, "{text}");
        }
    }
}
