//! Names on the wire.

/// Returns the name with every character outside `[A-Za-z0-9_-]` replaced by `_`, as Zenoh keys require. An
/// empty name becomes `_`.
pub fn wire_name(name: &str) -> String {
    if name.is_empty() {
        return "_".to_owned();
    }
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    name.chars().map(|c| if fits(c) { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::wire_name;

    #[test]
    fn a_wire_name_keeps_letters_digits_underscores_and_dashes() {
        assert_eq!(wire_name("Bench_Arm-1.2 rev B"), "Bench_Arm-1_2_rev_B");
        assert_eq!(wire_name("bras/épaule@1"), "bras__paule_1");
        assert_eq!(wire_name(""), "_");
    }
}
