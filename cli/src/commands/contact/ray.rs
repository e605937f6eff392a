//! `simctl contact ray`: first hits of straight lines.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use clap::Args;
use simd_client::{
    Client,
    proto::{Ray as Line, Vector3},
    ray,
};

use super::view::{HitView, hits};
use crate::{
    output::{Output, number::count},
    pose::parse_vector,
    quantity::bits,
    text_file,
};

/// A larger file has more rays than the daemon accepts: 20,000 of them with all their digits are 3 MB.
const MAX_BYTES: u64 = 4 * 1024 * 1024;

/// Clap's own usage only has the first of the two.
const USAGE: &str = "simctl contact ray [OPTIONS] <X,Y,Z> <X,Y,Z>
       simctl contact ray [OPTIONS] --rays <FILE>";

#[derive(Args, Debug)]
#[command(override_usage = USAGE)]
pub(crate) struct Ray {
    /// Start of the ray, metres
    #[arg(
        value_name = "X,Y,Z",
        value_parser = parse_vector,
        allow_hyphen_values = true,
        required_unless_present = "rays",
        conflicts_with = "rays"
    )]
    from: Option<Vector3>,
    /// End of the ray, metres
    #[arg(
        value_name = "X,Y,Z",
        value_parser = parse_vector,
        allow_hyphen_values = true,
        required_unless_present = "rays",
        conflicts_with = "rays"
    )]
    to: Option<Vector3>,
    /// File with several rays instead, at most 20,000: one line each, X Y Z of the start and X Y Z of the
    /// end, metres. - is the standard input
    #[arg(long, value_name = "FILE")]
    rays: Option<PathBuf>,
    /// Ignore links that are in none of these groups, a bit each, for instance 5 or 0x5
    #[arg(long, value_name = "BITS", value_parser = bits)]
    mask: Option<u32>,
}

pub(super) async fn run(arguments: Ray, client: &Client, output: Output) -> anyhow::Result<()> {
    let Ray { from, to, rays, mask } = arguments;
    let Some(file) = rays else {
        let found = client.cast_rays_in_groups([Line { from, to }], mask).await?;
        return output.one(&HitView::from(found.into_iter().next().unwrap_or_default()));
    };
    let found = client.cast_rays_in_groups(read(&file)?, mask).await?;
    let found: Vec<_> = found.into_iter().map(HitView::from).collect();
    output.list(&found, hits)
}

/// Reads the rays of a file, or of the standard input.
fn read(file: &Path) -> anyhow::Result<Vec<Line>> {
    parse(&text_file::read(file, MAX_BYTES)?).with_context(|| file.display().to_string())
}

/// Parses a ray per line; skips lines that are empty or begin with `#`.
fn parse(text: &str) -> anyhow::Result<Vec<Line>> {
    let mut rays = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let parts = line.split(|c: char| c == ',' || c.is_whitespace()).filter(|part| !part.is_empty());
        let numbers = parts.map(|part| {
            part.parse::<f64>().with_context(|| format!("line {}: {part:?} is not a number", index + 1))
        });
        let numbers: Vec<f64> = numbers.collect::<anyhow::Result<_>>()?;
        let &[x, y, z, to_x, to_y, to_z] = numbers.as_slice() else {
            let has = count(numbers.len(), "number");
            bail!("line {} has {has}; a ray has six: X Y Z of its start, X Y Z of its end", index + 1);
        };
        rays.push(ray([x, y, z], [to_x, to_y, to_z]));
    }
    if rays.is_empty() {
        bail!("it has no rays; each is a line of six numbers: X Y Z of its start, X Y Z of its end");
    }
    Ok(rays)
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::commands::Arguments;

    #[test]
    fn each_line_of_a_file_is_a_ray() {
        let rays = parse("# down\n0 0 2 0 0 -1\n\n1,0,2, 1e0,-0.5,-1\r\n\t3 4 5\t6 7 8").unwrap();
        assert_eq!(
            rays,
            [
                ray([0.0, 0.0, 2.0], [0.0, 0.0, -1.0]),
                ray([1.0, 0.0, 2.0], [1.0, -0.5, -1.0]),
                ray([3.0, 4.0, 5.0], [6.0, 7.0, 8.0]),
            ]
        );
    }

    #[test]
    fn the_usage_has_both_ways() {
        for line in ["simctl contact ray", "simctl contact ray --help"] {
            let said = Arguments::try_parse_from(line.split(' ')).unwrap_err().to_string();
            assert!(said.contains("Usage: simctl contact ray [OPTIONS] <X,Y,Z> <X,Y,Z>\n"), "{said}");
            assert!(said.contains("       simctl contact ray [OPTIONS] --rays <FILE>\n"), "{said}");
        }
    }

    #[test]
    fn a_mistake_names_its_line() {
        for (text, part) in [
            ("", "it has no rays"),
            ("# nothing\n\n", "it has no rays"),
            ("0 0 2 0 0 -1\n0 0 2", "line 2 has 3 numbers"),
            ("0 0 2 0 0 -1 1", "line 1 has 7 numbers"),
            ("\n0 0 high 0 0 -1", "line 2: \"high\" is not a number"),
        ] {
            let sentence = parse(text).unwrap_err().to_string();
            assert!(sentence.contains(part), "{text:?}: {sentence}");
        }
    }
}
