//! Transliteration: a word of Latin letters for each letter, since names of ROS allow only ASCII.

/// Letters of Latin, Greek and Cyrillic, lower case, and what stands for each.
const LETTERS: [(char, &str); 90] = [
    ('ß', "ss"),
    ('æ', "ae"),
    ('ð', "d"),
    ('ø', "o"),
    ('þ', "th"),
    ('đ', "d"),
    ('ħ', "h"),
    ('ı', "i"),
    ('ĸ', "k"),
    ('ł', "l"),
    ('ŋ', "ng"),
    ('œ', "oe"),
    ('ŧ', "t"),
    ('α', "a"),
    ('β', "v"),
    ('γ', "g"),
    ('δ', "d"),
    ('ε', "e"),
    ('ζ', "z"),
    ('η', "i"),
    ('θ', "th"),
    ('ι', "i"),
    ('κ', "k"),
    ('λ', "l"),
    ('μ', "m"),
    ('ν', "n"),
    ('ξ', "x"),
    ('ο', "o"),
    ('π', "p"),
    ('ρ', "r"),
    ('ς', "s"),
    ('σ', "s"),
    ('τ', "t"),
    ('υ', "y"),
    ('φ', "f"),
    ('χ', "ch"),
    ('ψ', "ps"),
    ('ω', "o"),
    ('а', "a"),
    ('б', "b"),
    ('в', "v"),
    ('г', "g"),
    ('д', "d"),
    ('е', "e"),
    ('ж', "zh"),
    ('з', "z"),
    ('и', "i"),
    ('й', "y"),
    ('к', "k"),
    ('л', "l"),
    ('м', "m"),
    ('н', "n"),
    ('о', "o"),
    ('п', "p"),
    ('р', "r"),
    ('с', "s"),
    ('т', "t"),
    ('у', "u"),
    ('ф', "f"),
    ('х', "kh"),
    ('ц', "ts"),
    ('ч', "ch"),
    ('ш', "sh"),
    ('щ', "shch"),
    ('ъ', ""),
    ('ы', "y"),
    ('ь', ""),
    ('э', "e"),
    ('ю', "yu"),
    ('я', "ya"),
    ('ё', "yo"),
    ('ђ', "dj"),
    ('є', "ye"),
    ('і', "i"),
    ('ї', "yi"),
    ('ј', "j"),
    ('љ', "lj"),
    ('њ', "nj"),
    ('ћ', "c"),
    ('ў', "u"),
    ('џ', "dz"),
    ('ґ', "g"),
    ('ғ', "g"),
    ('қ', "q"),
    ('ң', "n"),
    ('ү', "u"),
    ('ұ', "u"),
    ('һ', "h"),
    ('ә', "a"),
    ('ө', "o"),
];

/// Letters with marks: what stands for each of these.
const MARKED: [(&str, &str); 28] = [
    ("a", "àáâãäåāăąǎǟǡǻȁȃȧḁạảấầẩẫậắằẳẵặάӑӓӛ"),
    ("ae", "ǣǽ"),
    ("b", "ḃḅḇ"),
    ("c", "çćĉċčḉ"),
    ("ch", "ӵ"),
    ("d", "ďḋḍḏḑḓ"),
    ("e", "èéêëēĕėęěȅȇȩḕḗḙḛḝẹẻẽếềểễệέѐӗӭ"),
    ("f", "ḟ"),
    ("g", "ĝğġģǧǵḡѓ"),
    ("h", "ĥȟḣḥḧḩḫẖ"),
    ("i", "ìíîïĩīĭįǐȉȋḭḯỉịΐήίϊѝӣӥ"),
    ("j", "ĵǰ"),
    ("k", "ķǩḱḳḵќ"),
    ("l", "ĺļľḷḹḻḽ"),
    ("m", "ḿṁṃ"),
    ("n", "ñńņňǹṅṇṉṋ"),
    ("o", "òóôõöōŏőơǒǫǭǿȍȏȫȭȯȱṍṏṑṓọỏốồổỗộớờởỡợόώӧӫ"),
    ("p", "ṕṗ"),
    ("r", "ŕŗřȑȓṙṛṝṟ"),
    ("s", "śŝşšșṡṣṥṧṩ"),
    ("t", "ţťțṫṭṯṱẗ"),
    ("u", "ùúûüũūŭůűųưǔǖǘǚǜȕȗṳṵṷṹṻụủứừửữựӯӱӳ"),
    ("v", "ṽṿ"),
    ("w", "ŵẁẃẅẇẉẘ"),
    ("x", "ẋẍ"),
    ("y", "ýÿŷȳẏẙỳỵỷỹΰϋύӹ"),
    ("z", "źżžẑẓẕӟ"),
    ("zh", "ӂӝ"),
];

/// Returns what stands for a letter; `None` for a letter of another script, and for what is not a letter.
pub(super) fn latin(letter: char) -> Option<String> {
    let mut lower = letter.to_lowercase();
    let (Some(small), None) = (lower.next(), lower.next()) else { return None };
    let found = LETTERS.iter().find(|(known, _)| *known == small).map(|(_, latin)| *latin);
    let found = found
        .or_else(|| MARKED.iter().find(|(_, letters)| letters.contains(small)).map(|(latin, _)| *latin))?;
    let is_capital = small != letter;
    let mut letters = found.chars();
    let first = letters.next().map(|first| if is_capital { first.to_ascii_uppercase() } else { first });
    Some(first.into_iter().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_with_and_without_marks_have_latin_ones() {
        let of =
            |name: &str| name.chars().map(|c| latin(c).unwrap_or_else(|| "?".to_owned())).collect::<String>();
        assert_eq!(of("тест"), "test");
        assert_eq!(of("Щука"), "Shchuka");
        assert_eq!(of("ρομπότ"), "rompot");
        assert_eq!(of("éÅßŁ"), "eAssL");
        assert_eq!(of("机 1"), "???");
    }
}
