//! Names of atoms, residues and chains, held in place.

use std::fmt;

/// A short name of printable ASCII characters; empty where a file gives none.
///
/// It takes 16 bytes and no allocation: a million atoms have a million names.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Name {
    // Padded with zeros, which are no printable characters: the order is that of the texts.
    bytes: [u8; Name::LONGEST],
    length: u8,
}

impl Name {
    /// No name.
    pub const EMPTY: Name = Name {
        bytes: [0; Name::LONGEST],
        length: 0,
    };
    /// Most characters of a name.
    pub const LONGEST: usize = 15;

    /// A name without its outer blanks; `None` where it is longer than [`Name::LONGEST`] or has a
    /// character that is not printable ASCII.
    #[inline]
    pub fn new(text: &[u8]) -> Option<Name> {
        let text = text.trim_ascii();
        let mut name = Name::default();
        let place = name.bytes.get_mut(..text.len())?;
        place.copy_from_slice(text);
        name.length = text.len() as u8;
        let printable = |b: &u8| (b' '..=b'~').contains(b);
        text.iter().all(printable).then_some(name)
    }

    /// The text.
    #[inline]
    pub fn as_str(&self) -> &str {
        std::str::from_utf8(self.as_bytes()).expect("names are ASCII")
    }

    /// The text as bytes.
    #[inline]
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }

    /// Whether it is empty.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Whether it is this text, in any case.
    #[inline]
    pub fn is(&self, text: &str) -> bool {
        self.as_bytes().eq_ignore_ascii_case(text.as_bytes())
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl fmt::Debug for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_short_and_printable() {
        let text = |bytes: &[u8]| Name::new(bytes).map(|name| name.to_string());
        assert_eq!(text(b" CA "), Some("CA".into()));
        assert_eq!(text(b"  "), Some(String::new()));
        assert_eq!(text(b"abcdefghijklmno"), Some("abcdefghijklmno".into()));
        assert_eq!(text(b"abcdefghijklmnop"), None);
        assert_eq!(text(b"C\xc3\xa9"), None);
        assert_eq!(text(b"C\0A"), None);
        assert_eq!(size_of::<Name>(), 16);
    }

    #[test]
    fn names_are_ordered_as_texts() {
        let name = |text: &str| Name::new(text.as_bytes()).expect("a name");
        let mut names = ["CB", "C", "CA", "", "N"].map(name);
        names.sort();
        assert_eq!(names.map(|n| n.to_string()), ["", "C", "CA", "CB", "N"]);
        assert!(name("HEM").is("hem") && !name("HEM").is("HE"));
    }
}
