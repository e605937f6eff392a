//! Matches file names with `*`, `?` and `[...]`, as a shell does.

/// Returns whether a name matches a pattern. A sign never matches a leading dot.
pub(crate) fn fits(pattern: &str, name: &str) -> bool {
    if name.starts_with('.') && !pattern.starts_with('.') {
        return false;
    }
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    let (mut p, mut n) = (0, 0);
    // Position of the last `*`, and the end of its text.
    let mut star: Option<(usize, usize)> = None;
    while n < name.len() {
        let step = one(pattern.get(p..).unwrap_or_default(), name.get(n).copied().unwrap_or_default());
        match (pattern.get(p), step, star) {
            (Some('*'), _, _) => {
                star = Some((p + 1, n));
                p += 1;
            }
            (Some(_), Some(length), _) => {
                p += length;
                n += 1;
            }
            (_, _, Some((behind, from))) => {
                p = behind;
                n = from + 1;
                star = Some((behind, n));
            }
            _ => return false,
        }
    }
    pattern.get(p..).unwrap_or_default().iter().all(|c| *c == '*')
}

/// Returns the length of the part of the pattern that matches a character.
fn one(pattern: &[char], c: char) -> Option<usize> {
    match pattern {
        ['?', ..] => Some(1),
        ['[', inner @ ..] => {
            let (not, inner) = match inner {
                ['!', rest @ ..] => (true, rest),
                inner => (false, inner),
            };
            let end = inner.iter().skip(1).position(|c| *c == ']')? + 1;
            let all = inner.get(..end)?;
            let mut is = false;
            let mut at = 0;
            while let Some(first) = all.get(at) {
                match (all.get(at + 1), all.get(at + 2)) {
                    (Some('-'), Some(last)) => {
                        is |= (*first..=*last).contains(&c);
                        at += 3;
                    }
                    _ => {
                        is |= *first == c;
                        at += 1;
                    }
                }
            }
            (is != not).then_some(end + 2 + usize::from(not))
        }
        [first, ..] => (*first == c).then_some(1),
        [] => None,
    }
}

#[cfg(test)]
mod tests {
    use super::fits;

    #[test]
    fn names_fit_as_in_a_shell() {
        for (pattern, name, is) in [
            ("*.xacro", "a.xacro", true),
            ("*.xacro", "a.urdf", false),
            ("a*b*c", "aXbYbZc", true),
            ("a?c", "abc", true),
            ("a[b-d]e", "ace", true),
            ("a[!b-d]e", "ace", false),
            ("*", ".hidden", false),
            ("a", "ab", false),
        ] {
            assert_eq!(fits(pattern, name), is, "{pattern} {name}");
        }
    }
}
