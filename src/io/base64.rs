//! Base64 (RFC 4648, section 4).

/// What a character is: a digit from 0 to 63, or one of those below.
const KINDS: [u8; 256] = {
    let digits = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut kinds = [NONE; 256];
    let mut value = 0;
    while value < 64 {
        kinds[digits[value] as usize] = value as u8;
        value += 1;
    }
    kinds[b'=' as usize] = PADDING;
    kinds[b' ' as usize] = BLANK;
    kinds[b'\t' as usize] = BLANK;
    kinds[b'\r' as usize] = BLANK;
    kinds[b'\n' as usize] = BLANK;
    kinds
};
const PADDING: u8 = 64;
const BLANK: u8 = 65;
const NONE: u8 = 66;

/// Decodes a whole text without blanks; padding may be left out. The error says what is wrong.
pub fn decode(text: &str) -> Result<Vec<u8>, String> {
    let digits = text.trim_end_matches('=').as_bytes();
    let mut bytes = Vec::with_capacity(digits.len() / 4 * 3 + 2);
    for (block, four) in digits.chunks(4).enumerate() {
        let mut bits = 0u32;
        for (i, digit) in four.iter().enumerate() {
            let value = KINDS[usize::from(*digit)];
            if value >= PADDING {
                return Err(format!(
                    "character {} of its base64 data is no base64 digit",
                    4 * block + i
                ));
            }
            bits |= u32::from(value) << (18 - 6 * i);
        }
        if four.len() == 1 {
            return Err("its base64 data ends within a byte".into());
        }
        bytes.extend(&bits.to_be_bytes()[1..four.len()]);
    }
    Ok(bytes)
}

/// A text that is decoded as its bytes are asked for. Blanks are passed over, and padding may end a
/// part before the last: the next begins anew.
#[derive(Debug, Clone)]
pub struct Stream<'a> {
    text: &'a [u8],
    at: usize,
    /// Bytes decoded and not yet taken, the next one first.
    spare: [u8; 3],
    spares: usize,
}

impl<'a> Stream<'a> {
    /// A stream of a text.
    pub fn new(text: &'a [u8]) -> Self {
        Stream {
            text,
            at: 0,
            spare: [0; 3],
            spares: 0,
        }
    }

    /// No more bytes than these are left.
    pub fn most(&self) -> usize {
        self.spares + (self.text.len() - self.at).div_ceil(4) * 3
    }

    /// The next `count` bytes, no more than [`Stream::most`]. The error says what is wrong.
    pub fn take(&mut self, count: usize) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::with_capacity(count.min(self.most()) + 2);
        bytes.extend_from_slice(&self.spare[..self.spares.min(count)]);
        self.spare.copy_within(self.spares.min(count).., 0);
        self.spares -= self.spares.min(count);
        while bytes.len() < count {
            let (three, length) = self.group()?;
            if length == 0 {
                return Err(format!(
                    "its base64 data ends {} bytes early",
                    count - bytes.len()
                ));
            }
            bytes.extend_from_slice(&three[..length]);
        }
        self.spares += bytes.len() - count;
        for (to, from) in self.spare.iter_mut().zip(&bytes[count..]) {
            *to = *from;
        }
        bytes.truncate(count);
        Ok(bytes)
    }

    /// The bytes of the next four characters; none at the end.
    fn group(&mut self) -> Result<([u8; 3], usize), String> {
        let mut bits = 0u32;
        let mut digits = 0;
        let mut paddings = 0;
        while digits + paddings < 4 {
            let Some(character) = self.text.get(self.at) else {
                if digits + paddings == 0 {
                    return Ok(([0; 3], 0));
                }
                return Err("its base64 data ends within four characters".into());
            };
            match KINDS[usize::from(*character)] {
                BLANK => {}
                PADDING if digits >= 2 => paddings += 1,
                value if value < PADDING && paddings == 0 => {
                    bits |= u32::from(value) << (18 - 6 * digits);
                    digits += 1;
                }
                _ => {
                    return Err(format!(
                        "character {} of its base64 data is {:?}, which is out of place",
                        self.at,
                        char::from(*character)
                    ));
                }
            }
            self.at += 1;
        }
        let [_, three @ ..] = bits.to_be_bytes();
        Ok((three, digits - 1))
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Encodes base64 in the plain way, for the round trip.
    pub fn encoded(bytes: &[u8]) -> String {
        const DIGITS: &[u8; 64] =
            b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let mut text = String::new();
        for three in bytes.chunks(3) {
            let bits = three
                .iter()
                .enumerate()
                .fold(0u32, |w, (i, b)| w | u32::from(*b) << (16 - 8 * i));
            for i in 0..=three.len() {
                text.push(char::from(DIGITS[(bits >> (18 - 6 * i) & 63) as usize]));
            }
            text.push_str(&"=".repeat(3 - three.len()));
        }
        text
    }

    proptest! {
        #[test]
        fn base64_comes_back(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
            prop_assert_eq!(decode(&encoded(&bytes)).unwrap(), bytes);
        }

        #[test]
        fn parts_come_back_in_any_pieces(
            a in prop::collection::vec(any::<u8>(), 0..20),
            b in prop::collection::vec(any::<u8>(), 0..20),
            pieces in prop::collection::vec(0usize..9, 0..20),
        ) {
            let text = format!("{}\n {} ", encoded(&a), encoded(&b));
            let mut stream = Stream::new(text.as_bytes());
            let mut left = &*[a, b].concat();
            for piece in pieces {
                prop_assert!(stream.most() >= left.len());
                let Some((wanted, after)) = left.split_at_checked(piece) else {
                    prop_assert!(stream.take(piece).is_err());
                    break;
                };
                prop_assert_eq!(&stream.take(piece).unwrap()[..], wanted);
                left = after;
            }
        }
    }

    #[test]
    fn base64_that_is_none_is_named() {
        assert_eq!(decode("Zm9vYg").unwrap(), b"foob");
        let refused = decode("Zm9v!").unwrap_err();
        assert_eq!(refused, "character 4 of its base64 data is no base64 digit");
        let refused = decode("Zm9vY").unwrap_err();
        assert_eq!(refused, "its base64 data ends within a byte");
        let refusal = |text: &str| Stream::new(text.as_bytes()).take(4).unwrap_err();
        assert_eq!(refusal("Zm9v"), "its base64 data ends 1 bytes early");
        assert_eq!(
            refusal("Zm9vYg"),
            "its base64 data ends within four characters"
        );
        for (text, at, character) in [("Zm9 vY!==", 6, '!'), ("Z===", 1, '='), ("Zm=9", 3, '9')] {
            let wanted = format!(
                "character {at} of its base64 data is {character:?}, which is out of place"
            );
            assert_eq!(refusal(text), wanted);
        }
    }
}
