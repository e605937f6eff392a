//! Hostile meshes and saved states: each is answered within a bound of memory that its bytes justify.
//! Counted, not timed: the allocations of one thread are the same on every machine.

use std::path::Path;

use simd_core::simulation::command::{LinkProperties, MAX_LINK_PROPERTIES};
use simd_fuzz_targets::{collada, obj, stl};
use simd_model::robot::Sha256;
use simd_world::loading::saved_state_file::{Content, open, seal, seal_encoded};

/// Returns the most that was allocated at one time, bytes, with one copy of the file.
fn peak(target: fn(&[u8]), file: &[u8]) -> u64 {
    allocation_counter::measure(|| target(file)).bytes_max
}

fn dae(geometry: &str, nodes: &str) -> String {
    format!(
        "<COLLADA><library_geometries><geometry id=\"g\"><mesh>{geometry}</mesh></geometry></library_geometries>\
         <library_visual_scenes><visual_scene>{nodes}</visual_scene></library_visual_scenes></COLLADA>"
    )
}

const SOURCE: &str = "<source id=\"p\"><float_array id=\"a\" count=\"4294967295\">0 0 0 1 0 0 1 1 0</float_array>\
    <technique_common><accessor source=\"#a\" count=\"4294967295\" stride=\"3\"/></technique_common></source>";
const FACES: &str =
    "<triangles count=\"4294967295\"><input semantic=\"POSITION\" source=\"#p\"/><p>0 1 2</p></triangles>";
const SHOWN: &str = "<node><instance_geometry url=\"#g\"/></node>";

#[test]
fn short_files_that_claim_to_be_long_cost_little() {
    let counts = dae(&format!("{SOURCE}{FACES}"), SHOWN);
    let names = counts.replace("float_array", "Name_array");
    let strides = counts.replace("stride=\"3\"", "stride=\"18446744073709551615\"");
    let polygons = counts.replace("triangles", "polylist").replace("<p>", "<vcount>4294967295</vcount><p>");
    let itself = dae("", "<node id=\"n\"><instance_node url=\"#n\"/><instance_node url=\"#n\"/></node>");
    for file in [counts, names, strides, polygons, itself] {
        let peak = peak(collada, file.as_bytes());
        assert!(peak < 1 << 20, "{peak} bytes for {file}");
    }
    let mut claims = vec![0; 134];
    claims[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(peak(stl, &claims) < 1 << 20);
    for file in ["v 0 0 0\nf 1 1 9223372036854775807\n", "mtllib ../../../../etc/passwd\nv 0 0 0\nf 1 1 1\n"]
    {
        assert!(peak(obj, file.as_bytes()) < 1 << 20, "{file}");
    }
}

#[test]
fn nested_and_doubling_files_cost_what_their_bytes_justify() {
    let deep = "<a>".repeat(50_000) + &"</a>".repeat(50_000);
    let peak_of_deep = peak(collada, deep.as_bytes());
    assert!(peak_of_deep < 100 * deep.len() as u64, "{peak_of_deep} bytes");
    let mut nodes = String::new();
    for level in 0..60 {
        let next = format!("<instance_node url=\"#n{}\"/>", level + 1);
        nodes += &format!("<node id=\"n{level}\">{next}{next}</node>");
    }
    let doubling = dae(&format!("{SOURCE}{FACES}").replace("4294967295", "3"), &(nodes + SHOWN));
    let peak_of_doubling = peak(collada, doubling.as_bytes());
    assert!(peak_of_doubling < 1 << 20, "{peak_of_doubling} bytes");
}

#[test]
fn files_at_the_limit_of_triangles_and_beyond_stay_below_half_a_gigabyte() {
    const MAX: u64 = 450 << 20;
    let polygon = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf".to_owned() + &" 1 2 3".repeat(2_000_000);
    let of_polygon = peak(obj, polygon.as_bytes());
    let triangles = 2_000_000_u32;
    let mut file = vec![0; 84];
    file[80..84].copy_from_slice(&triangles.to_le_bytes());
    for triangle in 0..triangles {
        file.extend([0; 12]);
        // No two corners are at one place.
        file.extend((0..9).flat_map(|number| (triangle as f32 + number as f32 * 0.1).to_le_bytes()));
        file.extend([0; 2]);
    }
    let of_stl = peak(stl, &file);
    let floats = "0 1 2 ".repeat(5_000_000);
    let source = SOURCE.replace("0 0 0 1 0 0 1 1 0", &floats).replace("4294967295", "5000000");
    let of_collada = peak(collada, dae(&(source + FACES), &SHOWN.repeat(20)).as_bytes());
    println!("polygon {of_polygon}, STL {of_stl}, COLLADA {of_collada} bytes");
    assert!(of_polygon < MAX && of_stl < MAX && of_collada < MAX);
}

/// Opens a file of this content with a right hash.
fn peak_of_saved_state(content: &Content) -> (u64, u64) {
    let file = seal(content);
    let seen = allocation_counter::measure(|| drop(open(&file, 1_000)));
    (seen.bytes_max, file.len() as u64)
}

/// Entries of lists take most memory for their bytes. They have three bytes for a link's properties, one for
/// a file, and 33 for a mesh without a name. The rest is within a small factor.
#[test]
fn saved_states_cost_what_their_bytes_justify() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/saved_states/kinds");
    let content = open(&seal_encoded(&std::fs::read(path).unwrap()), 1_000).unwrap().content;
    let (plain, bytes) = peak_of_saved_state(&content);
    assert!(plain < 6 * bytes, "{plain} bytes for {bytes}");

    let mut properties = content.clone();
    properties.robots[0].state.entity.contact_settings.links =
        vec![LinkProperties::default(); MAX_LINK_PROPERTIES];
    let mut files = content.clone();
    files.files = vec![Vec::new().into(); 900_000];
    let mut meshes = content.clone();
    meshes.robots[0].source.assets = (0..50_000).map(|i: u32| (i.to_string(), Sha256([0; 32]))).collect();
    let mut overlaps = content.clone();
    overlaps.world.ignored_overlaps = vec![([0, 0], [0, 1]); 500_000];
    for content in [properties, files, meshes, overlaps] {
        let (peak, bytes) = peak_of_saved_state(&content);
        println!("{peak} bytes for {bytes}");
        assert!(peak < 70 * bytes && peak < 64 << 20, "{peak} bytes for {bytes}");
    }

    let mut more = content.clone();
    let links = &mut more.robots[0].state.entity.contact_settings.links;
    *links = vec![LinkProperties::default(); MAX_LINK_PROPERTIES + 1];
    let refused = open(&seal(&more), 1_000).unwrap_err().to_string();
    assert!(refused.contains("damaged"), "{refused}");

    // For any cut or false length, no memory is allocated for missing data.
    let whole = content.encode();
    for at in 0..whole.len() {
        let mut claims = whole[..at].to_vec();
        claims.extend([0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01]);
        let file = seal_encoded(&claims);
        let peak = allocation_counter::measure(|| drop(open(&file, 1_000))).bytes_max;
        assert!(peak < (1 << 20) + 6 * file.len() as u64, "{peak} bytes for a claim at {at}");
    }
}
