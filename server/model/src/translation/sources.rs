//! The files of a description: its own, and its includes, each decoded and parsed within the limits.

use std::borrow::Cow;

use roxmltree::Document;

use super::notes::{Notes, Stop};
use super::unread::Asked;
use crate::assets::Assets;
use crate::limits::LoadLimits;
use crate::urdf::findings::Findings;
use crate::urdf::mend;
use crate::urdf::prescan::{check_counts, check_depth, parse_xml, syntax};
use crate::urdf::text;

/// Maximum number of includes of one description.
const MAX_FILES: usize = 200;

/// The texts of files, before they are parsed.
pub(crate) struct Texts {
    word: &'static str,
    /// URI and text. The first is the file itself, without a URI.
    list: Vec<(String, String)>,
    bytes: usize,
    /// Requested files, found or not, in order.
    pub(crate) asked: Vec<String>,
    /// Repairs of the XML: URI, line and what was repaired.
    mended: Vec<(String, u32, String)>,
}

/// A parsed file.
pub(crate) struct Source<'t> {
    /// Name of the file; empty for the file that was sent.
    pub(crate) uri: String,
    pub(crate) document: Document<'t>,
    /// Record of the requests to its elements.
    pub(crate) asked: Asked,
    /// Offsets of the beginnings of lines, without the first.
    line_starts: Vec<usize>,
}

impl Texts {
    /// Begins with the file itself.
    pub(crate) fn new(bytes: &[u8], word: &'static str, limits: &LoadLimits) -> Result<Self, Stop> {
        let mut texts = Self { word, list: Vec::new(), bytes: 0, asked: Vec::new(), mended: Vec::new() };
        texts.add(String::new(), bytes, limits)?;
        Ok(texts)
    }

    fn add(&mut self, uri: String, bytes: &[u8], limits: &LoadLimits) -> Result<(), Stop> {
        self.bytes += bytes.len();
        let (size, cap) = (self.bytes, limits.urdf_bytes);
        if size > cap {
            let message =
                format!("the {} and its included files have {size} bytes; the limit is {cap}", self.word);
            return Err(Stop::of_file(None, None, message));
        }
        let mut findings = Findings::new(1);
        let decoded = text::decode(bytes, limits, &mut findings);
        let decoded = decoded.map_err(|refusal| self.stop(&uri, findings, refusal))?;
        // The declaration is no longer needed, and would be refused unless it is first.
        let mut text = decoded.trim_start().to_owned();
        let cut = decoded.len() - text.len();
        let newlines = decoded.bytes().take(cut).filter(|byte| *byte == b'\n').count();
        text.insert_str(0, &"\n".repeat(newlines));
        if let Some(start) = text.find("<?xml ")
            && let Some(end) = text.get(start..).and_then(|rest| rest.find("?>"))
        {
            let blank = " ".repeat(end + 2);
            text.replace_range(start..start + end + 2, &blank);
        }
        let checked = check_counts(&text, limits);
        checked.map_err(|refusal| self.stop(&uri, Findings::new(1), refusal))?;
        let mut mended = Vec::new();
        let text = mend::mended(Cow::Owned(text), &mut mended);
        let text = mend::bind_prefixes(text, limits, &mut mended).into_owned();
        self.mended.extend(mended.into_iter().map(|(line, message)| (uri.clone(), line, message)));
        self.list.push((uri, text));
        Ok(())
    }

    fn stop(&self, uri: &str, findings: Findings, refusal: crate::urdf::findings::Refusal) -> Stop {
        let refused = findings.refused(refusal);
        let last = refused.report.findings.last();
        let (line, message) = last.map(|last| (last.line, last.message.clone())).unwrap_or_default();
        let file = Some(uri.to_owned()).filter(|uri| !uri.is_empty());
        Stop::of_file(
            file,
            line,
            message.replace("a URDF", &format!("an {}", self.word)).replace("URDF", self.word),
        )
    }

    /// Requests an included file, once each. Returns whether it exists now.
    pub(crate) fn include(
        &mut self,
        uri: &str,
        assets: &dyn Assets,
        limits: &LoadLimits,
    ) -> Result<bool, Stop> {
        if self.list.iter().any(|(known, _)| known == uri) {
            return Ok(true);
        }
        if self.asked.iter().any(|asked| asked == uri) {
            return Ok(false);
        }
        if self.asked.len() >= MAX_FILES {
            let message = format!("it includes more than {MAX_FILES} files");
            return Err(Stop::of_file(None, None, message));
        }
        if uri.len() > limits.name_bytes {
            let cap = limits.name_bytes;
            let message =
                format!("the URI of a file that it includes has {} bytes; the limit is {cap}", uri.len());
            return Err(Stop::of_file(None, None, message));
        }
        self.asked.push(uri.to_owned());
        match assets.find(uri) {
            Ok(asset) => self.add(uri.to_owned(), &asset.bytes, limits).map(|()| true),
            Err(_places) => Ok(false),
        }
    }

    /// Adds a built-in text, once.
    pub(crate) fn include_text(&mut self, name: &str, bytes: &[u8], limits: &LoadLimits) -> Result<(), Stop> {
        if self.list.iter().any(|(known, _)| known == name) {
            return Ok(());
        }
        self.add(name.to_owned(), bytes, limits)
    }

    /// Returns notes on the repairs of the texts.
    pub(crate) fn notes(&self, most: usize) -> Notes {
        let mut notes = Notes::new(most);
        for (uri, line, message) in &self.mended {
            notes.of_text(uri, *line, message.clone());
        }
        notes
    }

    /// Returns the text at an index; texts are in the order of the includes.
    pub(crate) fn get(&self, index: usize) -> Option<(&str, &str)> {
        self.list.get(index).map(|(uri, text)| (uri.as_str(), text.as_str()))
    }

    /// Parses all texts.
    pub(crate) fn parse(&self, limits: &LoadLimits) -> Result<Vec<Source<'_>>, Stop> {
        (0..self.list.len()).map(|index| self.parse_one(index, limits)).collect()
    }

    /// Parses one text.
    pub(crate) fn parse_one(&self, index: usize, limits: &LoadLimits) -> Result<Source<'_>, Stop> {
        let (uri, text) = self.get(index).unwrap_or_default();
        let stop = |refusal| self.stop(uri, Findings::new(1), refusal);
        let document = parse_xml(text, limits).map_err(|error| stop(syntax(error, limits)))?;
        check_depth(&document, limits.xml_depth).map_err(stop)?;
        let line_starts = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i + 1).collect();
        Ok(Source { uri: uri.to_owned(), document, asked: Asked::default(), line_starts })
    }
}

impl Source<'_> {
    /// Returns the line of an offset, from 1.
    pub(crate) fn line(&self, offset: usize) -> u32 {
        u32::try_from(self.line_starts.partition_point(|line| *line <= offset) + 1).unwrap_or(u32::MAX)
    }
}
