//! The LZF coding of Marc Lehmann's liblzf, in which PCD files are packed.
//!
//! A control byte below 32 is followed by that many bytes and one more as they are. Else its upper
//! three bits are a length less two (7: a byte more of it follows), its lower five and the byte
//! after are how far back a copy begins, less one; copies may overlap what they make.

/// The longest run that three bytes stand for.
const LONGEST: usize = 264;

/// At most how many bytes so many packed bytes stand for.
pub fn most(packed: usize) -> usize {
    packed.div_ceil(2).saturating_mul(LONGEST)
}

/// Unpacks all of `packed`, which stands for `length` bytes.
///
/// Errs with the offset into `packed` where it goes wrong, and what is: it ends within a run, goes
/// back to before the first byte, or stands for more or fewer bytes. Cost: linear, and `length`
/// bytes; the caller knows that they may be held.
pub fn unpack(packed: &[u8], length: usize) -> Result<Vec<u8>, (usize, String)> {
    let mut out = Vec::with_capacity(length.min(most(packed.len())));
    let mut at = 0;
    while let Some(&control) = packed.get(at) {
        let start = at;
        let control = usize::from(control);
        let byte = |at: usize| match packed.get(at) {
            Some(byte) => Ok(usize::from(*byte)),
            None => Err((at, "the packed data ends within a run".to_owned())),
        };
        let run = if control < 32 {
            control + 1
        } else if control >> 5 < 7 {
            (control >> 5) + 2
        } else {
            at += 1;
            byte(at)? + 9
        };
        if out.len() + run > length {
            let problem = format!("the packed data stands for more than {length} bytes");
            return Err((start, problem));
        }
        at += 1;
        if control < 32 {
            let Some(bytes) = packed.get(at..at + run) else {
                byte(packed.len())?;
                unreachable!("a byte past the end is none");
            };
            out.extend_from_slice(bytes);
            at += run;
            continue;
        }
        let back = ((control & 31) << 8 | byte(at)?) + 1;
        at += 1;
        let Some(from) = out.len().checked_sub(back) else {
            let problem = format!("a copy goes back {back} bytes, but there are {}", out.len());
            return Err((start, problem));
        };
        if back >= run {
            out.extend_from_within(from..from + run);
        } else {
            for i in from..from + run {
                out.push(out[i]);
            }
        }
    }
    if out.len() < length {
        let problem = format!("the packed data stands for {} of {length} bytes", out.len());
        return Err((packed.len(), problem));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn runs_are_copied_from_either_side() {
        // Three bytes as they are, then six from three back, then ten of the last one.
        let packed = [2, b'a', b'b', b'c', 4 << 5, 2, 7 << 5, 1, 0];
        assert_eq!(unpack(&packed, 19).unwrap(), b"abcabcabccccccccccc");
        assert_eq!(unpack(&[], 0).unwrap(), b"");
    }

    #[test]
    fn damage_is_told_with_its_place() {
        let said = |packed: &[u8], length| unpack(packed, length).unwrap_err();
        assert_eq!(
            said(&[2, 1], 3),
            (2, "the packed data ends within a run".into())
        );
        assert_eq!(
            said(&[7 << 5], 30),
            (1, "the packed data ends within a run".into())
        );
        assert_eq!(
            said(&[0, 1, 32, 1], 4),
            (2, "a copy goes back 2 bytes, but there are 1".into())
        );
        assert_eq!(
            said(&[1, 1, 1], 3),
            (3, "the packed data stands for 2 of 3 bytes".into())
        );
        assert_eq!(
            said(&[1, 1, 1], 1),
            (0, "the packed data stands for more than 1 bytes".into())
        );
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic_or_grow(
            packed in prop::collection::vec(any::<u8>(), 0..200),
            length in 0..100_000usize,
        ) {
            prop_assert!(unpack(&packed, length).is_err() || length <= most(packed.len()));
        }
    }
}
