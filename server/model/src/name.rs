//! Names of robots, sensors, constraints and recordings.

/// Returns whether a name may have this character: a letter or digit of any script, a mark of a letter, `_` or `-`.
///
/// Zenoh keys reserve other characters of ASCII. Names have no invisible characters: two of them would look equal.
fn fits(c: char) -> bool {
    if c.is_ascii() {
        return c.is_ascii_alphanumeric() || c == '_' || c == '-';
    }
    let is_symbol = matches!(
        u32::from(c),
        // Punctuation, symbols and private characters; marks of variants and of byte order.
        0x2000..=0x2BFF | 0x3000..=0x303F | 0xE000..=0xF8FF | 0xFE00..=0xFE0F | 0xFEFF | 0xFFF0..=0xFFFF | 0xE0000..
    );
    c.is_alphanumeric() || (u32::from(c) >= 0x300 && !is_symbol && !c.is_control() && !c.is_whitespace())
}

/// Returns whether a robot may have this name: letters and digits of any script, their marks, `_` and `-`. It has at
/// least one character.
pub fn is_wire_name(name: &str) -> bool {
    !name.is_empty() && name.chars().all(fits)
}

/// Returns the name with every other character replaced by `_`. An empty name becomes `_`.
pub fn wire_name(name: &str) -> String {
    if name.is_empty() {
        return "_".to_owned();
    }
    name.chars().map(|c| if fits(c) { c } else { '_' }).collect()
}

/// Returns the beginning of a name, of at most `most` bytes.
pub fn first_bytes(name: &str, most: usize) -> &str {
    let end = name.char_indices().map(|(at, c)| at + c.len_utf8()).take_while(|end| *end <= most).last();
    name.get(..end.unwrap_or(0)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wire_name_keeps_letters_of_any_script_digits_underscores_and_dashes() {
        for (name, expected) in [
            ("Bench_Arm-1.2 rev B", "Bench_Arm-1_2_rev_B"),
            ("bras/épaule@1", "bras_épaule_1"),
            ("тест", "тест"),
            ("机器人 2", "机器人_2"),
            ("ロボット", "ロボット"),
            ("रोबोट", "रोबोट"),
            ("e\u{301}*", "e\u{301}_"),
            ("a\u{200b}b\u{202e}c\u{feff}d\u{3000}e", "a_b_c_d_e"),
            ("", "_"),
        ] {
            assert_eq!(wire_name(name), expected);
            assert!(is_wire_name(&wire_name(name)), "{name}");
            assert_eq!(is_wire_name(name), name == expected, "{name}");
        }
    }

    #[test]
    fn no_name_has_a_character_that_zenoh_reserves() {
        let reserved = ['/', '*', '$', '?', '#', ' ', '\0', '\n', '@', ':', '.', '%'];
        assert!(reserved.iter().all(|c| !is_wire_name(&format!("a{c}"))));
    }

    #[test]
    fn a_name_is_cut_between_characters() {
        assert_eq!(
            (first_bytes("тест", 5), first_bytes("тест", 8), first_bytes("тест", 1)),
            ("те", "тест", "")
        );
    }
}
