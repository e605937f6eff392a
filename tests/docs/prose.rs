//! Plain English: openings and lengths of sentences in documents and comments, and phrases that they avoid.

use std::collections::HashMap;
use std::fs;

use crate::{documents, read, root, words};

/// A sentence begins with its subject, or with a verb.
const OPENINGS: [&str; 11] = [
    "Of",
    "So many",
    "The same for",
    "The same from",
    "The same if",
    "The same of",
    "The same with",
    "What",
    "Where",
    "Who",
    "Whose",
];

/// Phrases, and their replacements.
const PHRASES: [(&str, &str); 19] = [
    ("again and again", "say how often, or what for"),
    ("anew", "again"),
    ("at the most", "at most"),
    ("but for", "except for"),
    ("by itself", "alone, automatically"),
    ("for ever", "forever"),
    ("go on", "continue"),
    ("goes on", "continues"),
    ("has left", "say what it is now"),
    ("has to be there", "must exist"),
    ("in silence", "silently"),
    ("in the midst", "within, during"),
    ("is there", "exists"),
    ("of its own", "a separate"),
    ("of their own", "separate"),
    ("that of", "name the thing again"),
    ("too much", "overload, above the limit"),
    ("who comes", "name the client"),
    ("whom", "name the thing"),
];

/// Words after "is no" that compare.
const COMPARISONS: [&str; 9] =
    ["better", "faster", "further", "larger", "later", "less", "longer", "more", "worse"];

const MAX_WORDS: usize = 25;

#[derive(Debug, PartialEq)]
struct Sentence {
    /// Line of its block's start, from 1.
    line: usize,
    text: String,
    /// Names and other code in a cell of a table do not count as words, since a cell may list them.
    is_cell: bool,
}

/// Paragraphs, items of lists, headings and cells of tables, with their lines; no code.
fn blocks(text: &str) -> Vec<Sentence> {
    let mut blocks: Vec<Sentence> = Vec::new();
    let mut is_code = false;
    // Whether the next line continues the last block.
    let mut is_open = false;
    for (line, raw) in (1..).zip(text.lines()) {
        let trimmed = raw.trim().trim_start_matches("> ");
        if trimmed.starts_with("```") {
            is_code = !is_code;
            is_open = false;
            continue;
        }
        if is_code || trimmed.is_empty() || trimmed.starts_with("<!--") || trimmed.starts_with("![") {
            is_open = false;
            continue;
        }
        if let Some(row) = trimmed.strip_prefix('|') {
            is_open = false;
            let cells = row.split('|').map(str::trim).filter(|cell| cell.contains(char::is_alphanumeric));
            blocks.extend(cells.map(|cell| Sentence { line, text: cell.to_owned(), is_cell: true }));
            continue;
        }
        let heading = trimmed.trim_start_matches('#');
        let item = item(trimmed);
        let is_heading = heading.len() < trimmed.len() && heading.starts_with(' ');
        match blocks.last_mut() {
            Some(last) if is_open && item.is_none() && !is_heading => {
                last.text.push(' ');
                last.text.push_str(trimmed);
            }
            _ => {
                let text = if is_heading { heading.trim() } else { item.unwrap_or(trimmed) };
                blocks.push(Sentence { line, text: text.to_owned(), is_cell: false });
            }
        }
        is_open = !is_heading;
    }
    blocks
}

/// The text of an item of a list.
fn item(line: &str) -> Option<&str> {
    let bullet = line.strip_prefix("* ").or_else(|| line.strip_prefix("- "));
    bullet.or_else(|| {
        line.split_once(". ").filter(|(number, _)| number.parse::<u8>().is_ok()).map(|(_, it)| it)
    })
}

/// Returns the text without code, addresses of links and emphasis.
fn plain(text: &str) -> String {
    let is_code = |index: &usize| index % 2 == 1;
    let parts = text.split('`').enumerate();
    let without_code: String =
        parts.map(|(index, part)| if is_code(&index) { "CODE" } else { part }).collect();
    let mut plain = String::new();
    let mut rest = without_code.as_str();
    while let Some((before, address)) = rest.split_once("](") {
        plain.push_str(before);
        rest = address.split_once(')').map_or("", |(_, after)| after);
    }
    plain.push_str(rest);
    plain.replace(['*', '[', ']'], "")
}

fn sentences(blocks: Vec<Sentence>) -> Vec<Sentence> {
    let mut sentences = Vec::new();
    for Sentence { line, text, is_cell } in blocks {
        let text = plain(&text);
        let mut sentence = String::new();
        for word in text.split_whitespace() {
            if !sentence.is_empty() {
                sentence.push(' ');
            }
            sentence.push_str(word);
            let end = word.trim_end_matches([')', '"', '\'']);
            let is_abbreviation = ["e.g.", "i.e.", "vs."].iter().any(|it| end.ends_with(it));
            if end.ends_with(['.', '!', '?']) && !is_abbreviation {
                sentences.push(Sentence { line, text: std::mem::take(&mut sentence), is_cell });
            }
        }
        if !sentence.is_empty() {
            sentences.push(Sentence { line, text: sentence, is_cell });
        }
    }
    sentences
}

fn number_of_words(sentence: &str, is_cell: bool) -> usize {
    let is_code = |word: &str| word.trim_matches(|c: char| !c.is_alphanumeric()) == "CODE";
    let counts = |word: &&str| word.contains(char::is_alphanumeric) && !(is_cell && is_code(word));
    sentence.split_whitespace().filter(counts).count()
}

/// Returns the faults of a sentence, each as a fragment for people.
fn faults(sentence: &str, is_cell: bool) -> Vec<String> {
    let mut faults = Vec::new();
    let has = |phrase: &str| words::has_phrase(sentence, phrase);
    let is_question = sentence.ends_with('?');
    for opening in OPENINGS {
        let rest = sentence.strip_prefix(opening);
        if rest.is_some_and(|rest| rest.starts_with([' ', ','])) && !is_question {
            faults.push(format!("begins with {opening:?}; begin with the subject"));
        }
    }
    for (phrase, better) in PHRASES {
        if has(phrase) {
            faults.push(format!("has {phrase:?}; {better}"));
        }
    }
    if denies_a_noun(sentence) && !is_question {
        faults.push("denies a noun; say \"is not a ...\"".to_owned());
    }
    let words = number_of_words(sentence, is_cell);
    if words > MAX_WORDS {
        faults.push(format!("has {words} words; the most is {MAX_WORDS}: make two sentences or a list"));
    }
    faults
}

/// Returns true for a verb and `no` before a noun, as in `is no picture`, except after `there`.
fn denies_a_noun(sentence: &str) -> bool {
    let words: Vec<&str> =
        sentence.split_whitespace().map(|word| word.trim_matches(['(', ',', '.'])).collect();
    (1..words.len()).any(|no| {
        let is_verb = ["is", "are", "was", "were"].contains(&words[no - 1]);
        let is_there = no > 1 && words[no - 2].eq_ignore_ascii_case("there");
        let compares = words.get(no + 1).is_none_or(|next| COMPARISONS.contains(next));
        words[no] == "no" && is_verb && !is_there && !compares
    })
}

fn wrong(path: &str, blocks: Vec<Sentence>) -> Vec<String> {
    let said = sentences(blocks).into_iter().flat_map(|Sentence { line, text, is_cell }| {
        faults(&text, is_cell).into_iter().map(move |fault| format!("{line}: {text:?} {fault}"))
    });
    said.map(|said| format!("{path}:{said}")).collect()
}

/// Comments of a source file as Markdown, and docstrings of Python except those of scripts. Code becomes empty
/// lines, so that lines keep their numbers.
fn comments(ending: &str, source: &str) -> String {
    let mut is_within = false;
    let comment = |line: &str| {
        let line = line.trim();
        match ending {
            "rs" => ["///", "//!", "//"].iter().find_map(|mark| line.strip_prefix(*mark)),
            "py" => {
                let text = line.strip_prefix("\"\"\"");
                let starts = !is_within && text.is_some();
                let text = text.filter(|_| starts).unwrap_or(line);
                let was_within = is_within || starts;
                is_within = was_within && !text.ends_with("\"\"\"");
                was_within.then(|| text.trim_end_matches('"')).or(line.strip_prefix("# "))
            }
            "script" | "toml" => line.strip_prefix("# "),
            _ => {
                let starts = line.starts_with("/*");
                let was_within = is_within || starts;
                is_within = was_within && !line.ends_with("*/");
                let text = line.trim_start_matches('/').trim_start_matches('*');
                let text = text.trim_end_matches('/').trim_end_matches('*');
                (was_within || line.starts_with("//")).then_some(text)
            }
        }
        .map(|text| text.strip_prefix(' ').unwrap_or(text).to_owned())
        .unwrap_or_default()
    };
    source.lines().map(comment).map(|line| line + "\n").collect()
}

#[test]
fn sentences_of_documents_are_plain() {
    let wrong = |document: String| wrong(&document, blocks(&read(&document)));
    let found: Vec<String> = documents().into_iter().flat_map(wrong).collect();
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn no_sentence_is_said_twice() {
    let mut places: HashMap<Vec<String>, String> = HashMap::new();
    let mut found = Vec::new();
    for document in documents() {
        for Sentence { line, text, is_cell } in sentences(blocks(&read(&document))) {
            // The order of words does not matter, and cells are short.
            let mut words: Vec<String> = text.split_whitespace().map(str::to_lowercase).collect();
            words.sort();
            let place = format!("{document}:{line}");
            if !is_cell && words.len() >= 8 {
                let before = places.insert(words, place.clone());
                found.extend(before.map(|before| format!("{place} and {before}: {text:?}")));
            }
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn each_page_opens_with_its_readers_and_what_they_get() {
    for page in documents().into_iter().filter(|page| page.starts_with("docs/")) {
        let text = read(&page);
        let opening = text.split("\n\n").nth(1).unwrap_or_default();
        assert!(
            opening.starts_with("For people "),
            "{page} does not open with \"For people who ...\": {opening:?}"
        );
        let has_result =
            ["Afterwards ", "At the end ", "At its end "].iter().any(|words| opening.contains(words));
        assert!(
            has_result,
            "{page} does not say what its readers get: \"Afterwards you know ...\": {opening:?}"
        );
    }
}

#[test]
fn comments_are_plain() {
    let mut files = Vec::new();
    words::files(&root(), &mut files);
    let mut found = Vec::new();
    for file in files {
        let ending = file.extension().and_then(|it| it.to_str()).unwrap_or_default();
        let path = file.strip_prefix(root()).unwrap().to_str().unwrap().replace('\\', "/");
        // Scripts have data in the form of docstrings.
        let is_script = ending == "py" && !path.starts_with("client/python/src/");
        let ending = if is_script { "script" } else { ending };
        if ["proto", "py", "rs", "script", "toml", "ts", "tsx", "wgsl"].contains(&ending) {
            found.extend(wrong(&path, blocks(&comments(ending, &fs::read_to_string(&file).unwrap()))));
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn prose_that_has_to_be_translated_is_found() {
    let riddles = [
        "No transport has a call of its own",
        "Who looks again and again gets what has changed",
        "The last message for who comes late",
        "What is discontinuous starts anew, without a kick",
        "Who touches whom",
        "When it is too much",
        "Takes robots whose state the step has left not finite out of the simulation",
        "False where it was interrupted; then the world is in the midst of a step",
        "So many permits. For one may wait so many calls",
        "What normal impulses make of these, less them",
        "Where to; it has to be there",
        "The same of an answer that is for one caller alone",
        "Where bodies are with joints at 0",
        "A file that is no picture",
        "The row is computed anew",
    ];
    for riddle in riddles {
        for text in [riddle.to_owned(), format!("## {riddle}\n"), format!("* Before.\n* {riddle}\n")] {
            assert!(!wrong("a.md", blocks(&text)).is_empty(), "{text:?}");
        }
        let of_comments = [
            ("rs", format!("struct A;\n    /// {riddle}\n")),
            ("rs", format!("let a = 1; // not read\n    // {riddle}\n")),
            ("ts", format!("const a = 1; // not read\n  // {riddle}\n")),
            ("tsx", format!("/** {riddle} */\nconst a = 1;\n")),
            ("py", format!("def a():\n    \"\"\"{riddle}\"\"\"\n    b = 1\n")),
            ("py", format!("b = 1\n# {riddle}\nc = 2\n")),
            ("script", format!("b = \"\"\"no comment\"\"\"\n    # {riddle}\n")),
            ("toml", format!("[a]\n# {riddle}\nb = 1\n")),
        ];
        for (ending, source) in of_comments {
            let found = wrong("a", blocks(&comments(ending, &source))).len();
            assert_eq!(found, wrong("a.md", blocks(riddle)).len(), "{source}");
        }
    }
    let plain = [
        "Every method is served on every transport",
        "Pollers receive deltas",
        "Late subscribers get the last message (transient local)",
        "Integration restarts after a discontinuity",
        "Collision filtering",
        "Overload",
        "Disables robots whose state is not finite",
        "Returns false if interrupted, leaving the world mid-step",
        "`permits` permits, with at most `waiting` queued calls",
        "Residual of the friction bounds",
        "Output directory (must exist)",
        "Like `once`, for answers private to one caller",
        "What does a step cost?",
        "There is no picture, and the claim is no longer held",
    ];
    for text in plain {
        assert_eq!(wrong("a.md", blocks(text)), Vec::<String>::new());
    }
}

#[test]
fn a_sentence_ends_where_its_block_does() {
    let word = "word ".repeat(MAX_WORDS);
    assert!(wrong("a.md", blocks(&word)).is_empty());
    assert_eq!(
        wrong("a.md", blocks(&format!("one\n{word}"))),
        [format!(
            "a.md:1: {:?} has 26 words; the most is 25: make two sentences or a list",
            format!("one {}", word.trim_end())
        )]
    );
    let cell = format!("| {word}| one |\n| `{}`word |", "name` and `".repeat(MAX_WORDS - 1));
    assert!(wrong("a.md", blocks(&cell)).is_empty());
    assert_eq!(wrong("a.md", blocks(&format!("| {word}one |"))).len(), 1);
    for end in [".\n", "\n\n", "\n\n* ", "\n| a | ", "\n```\n"] {
        assert!(wrong("a.md", blocks(&format!("one{end}{word}"))).is_empty(), "{end:?}");
    }
    let code = format!("```\n{word}{word}\n```\n`{word}{word}` is [one](http://a/{}).", "b/".repeat(30));
    assert!(wrong("a.md", blocks(&code)).is_empty());
}
