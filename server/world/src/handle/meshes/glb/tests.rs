//! The written file is valid glTF, and shows the mesh.

use simd_model::robot::{ImageKind, Paint, Sha256, Texture};

use super::*;

fn mesh(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> MeshAsset {
    MeshAsset {
        sha256: Sha256::of(b"mesh"),
        vertices: vertices.iter().map(|vertex| DVec3::from_array(*vertex)).collect(),
        triangles: triangles.to_vec(),
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    }
}

/// Returns a cube of side 1 about the origin, whose faces share corners.
fn cube() -> MeshAsset {
    let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|bit| bit as f64 - 0.5);
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> =
        sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    mesh(&std::array::from_fn::<_, 8, _>(corner), &triangles)
}

/// Returns a ball of radius 1 with `rings` times `2 rings` sides.
fn ball(rings: u32) -> MeshAsset {
    let (around, turn) = (2 * rings, std::f64::consts::TAU / f64::from(2 * rings));
    let mut vertices = Vec::new();
    for i in 0..=rings {
        let (sin, cos) = if i == rings { (0.0, -1.0) } else { (f64::from(i) * turn).sin_cos() };
        vertices.extend((0..around).map(|j| {
            let (y, x) = (f64::from(j) * turn).sin_cos();
            [sin * x, sin * y, cos]
        }));
    }
    let at = |i: u32, j: u32| i * around + j % around;
    let square =
        |i, j| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
    let triangles: Vec<[u32; 3]> =
        (0..rings).flat_map(|i| (0..around).flat_map(move |j| square(i, j))).collect();
    mesh(&vertices, &triangles)
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

/// Returns the JSON and the binary chunk, after checks of the file's lengths.
fn read(file: &[u8]) -> (serde_json::Value, Vec<u8>) {
    assert_eq!((word(file, 0), word(file, 4), word(file, 8) as usize), (MAGIC, VERSION, file.len()));
    let json = word(file, 12) as usize;
    assert_eq!((word(file, 16), json % 4), (JSON, 0));
    let bin = 20 + json;
    assert_eq!(word(file, bin + 4), BIN);
    let rest = &file[bin + 8..];
    assert_eq!((word(file, bin) as usize, rest.len() % 4), (rest.len(), 0));
    (serde_json::from_slice(&file[20..bin]).unwrap(), rest.to_vec())
}

/// Returns positions, normals and indices as the accessors define them.
fn contents(file: &[u8]) -> (Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<u32>) {
    let (json, bytes) = read(file);
    assert_eq!(json["buffers"][0]["byteLength"], bytes.len());
    let part = |accessor: usize, size: usize| {
        let accessor = &json["accessors"][accessor];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let (offset, length) = (view["byteOffset"].as_u64().unwrap(), view["byteLength"].as_u64().unwrap());
        // Indices of several colours share one view.
        let own = accessor["count"].as_u64().unwrap() as usize * size;
        let is_whole = own == length as usize || accessor["type"] == "SCALAR";
        assert!(is_whole, "{accessor}");
        bytes[offset as usize..(offset + length) as usize].to_vec()
    };
    let vectors = |accessor| -> Vec<[f32; 3]> {
        let values = part(accessor, 12);
        let vector = |at: &[u8]| std::array::from_fn(|i| f32::from_bits(word(at, 4 * i)));
        values.chunks(12).map(vector).collect()
    };
    (vectors(0), vectors(1), part(2, 4).chunks(4).map(|at| word(at, 0)).collect())
}

/// Checks that each corner of each triangle is where the mesh has it.
fn agrees(mesh: &MeshAsset) -> (Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<u32>) {
    let file = write(mesh);
    let (positions, normals, indices) = contents(&file);
    assert_eq!((positions.len(), indices.len()), (normals.len(), 3 * mesh.triangles.len()));
    for (index, vertex) in indices.iter().zip(mesh.triangles.iter().flatten()) {
        assert_eq!(positions[*index as usize], single(mesh.vertices[*vertex as usize]));
    }
    for normal in &normals {
        let length = normal.iter().map(|x| x * x).sum::<f32>().sqrt();
        assert!((length - 1.0).abs() < 1e-5, "{normal:?}");
    }
    (positions, normals, indices)
}

#[test]
fn a_cube_keeps_its_edges_and_says_its_bounds() {
    let (positions, normals, indices) = agrees(&cube());
    // Three normals at each of the eight corners.
    assert_eq!(positions.len(), 24);
    for triangle in indices.chunks(3) {
        let at = triangle.iter().map(|index| normals[*index as usize]);
        for normal in at {
            let axes = normal.iter().filter(|x| x.abs() > 0.999).count();
            assert_eq!(axes, 1, "{normal:?}");
        }
    }
    let (json, _) = read(&write(&cube()));
    assert_eq!(json["accessors"][0]["min"], serde_json::json!([-0.5, -0.5, -0.5]));
    assert_eq!(json["accessors"][0]["max"], serde_json::json!([0.5, 0.5, 0.5]));
}

/// The normal of a ball is its radius, to less than the angle between neighbouring sides.
#[test]
fn a_ball_is_smooth() {
    let ball = ball(24);
    let (positions, normals, _) = agrees(&ball);
    assert!(positions.len() <= ball.vertices.len(), "no corner is doubled");
    for (position, normal) in positions.iter().zip(&normals) {
        let cosine: f32 = position.iter().zip(normal).map(|(a, b)| a * b).sum();
        assert!(cosine > (std::f32::consts::PI / 24.0).cos(), "{position:?} {normal:?}");
    }
}

#[test]
fn triangles_without_area_or_with_too_many_neighbours_have_normals() {
    agrees(&mesh(&[[0.0; 3], [1.0, 0.0, 0.0]], &[[0, 0, 0], [0, 1, 0], [0, 1, 1]]));
    // A million triangles at one corner, too many for pairwise smoothing.
    let rim = 1_000_000_u32;
    let point = |i: u32| {
        let (y, x) = (f64::from(i) * std::f64::consts::TAU / f64::from(rim)).sin_cos();
        [x, y, -1.0]
    };
    let vertices: Vec<[f64; 3]> = std::iter::once([0.0; 3]).chain((0..rim).map(point)).collect();
    let triangles: Vec<[u32; 3]> = (0..rim).map(|i| [0, 1 + i, 1 + (i + 1) % rim]).collect();
    let file = write(&mesh(&vertices, &triangles));
    let (json, _) = read(&file);
    assert_eq!(json["accessors"][2]["count"], 3 * rim);
}

#[test]
fn far_away_and_tiny_is_written_too() {
    let far = 1e18;
    let (positions, _, _) =
        agrees(&mesh(&[[far, 0.0, 0.0], [0.0, far, 0.0], [0.0, 0.0, -far]], &[[0, 1, 2]]));
    assert!(positions.iter().flatten().all(|value| value.is_finite()));
    agrees(&mesh(&[[1e-30, 0.0, 0.0], [0.0, 1e-30, 0.0], [0.0; 3]], &[[0, 1, 2]]));
}

#[test]
fn each_colour_is_a_separate_part() {
    let red = Some([1.0, 0.0, 0.5]);
    let paint = |first, color| Paint::plain(first, color);
    let painted = MeshAsset { paints: vec![paint(2, red), paint(4, None), paint(6, red)], ..cube() };
    let (json, bytes) = read(&write(&painted));
    let primitives = json["meshes"][0]["primitives"].as_array().unwrap();
    assert_eq!((primitives.len(), json["materials"].as_array().unwrap().len()), (2, 2));
    let mut seen = Vec::new();
    for primitive in primitives {
        let accessor = &json["accessors"][primitive["indices"].as_u64().unwrap() as usize];
        let view = &json["bufferViews"][2];
        let offset = view["byteOffset"].as_u64().unwrap() + accessor["byteOffset"].as_u64().unwrap();
        let count = accessor["count"].as_u64().unwrap() as usize;
        let index = |n: usize| word(&bytes, offset as usize + 4 * n);
        seen.push((0..count).map(index).collect::<Vec<u32>>());
    }
    // Triangles 0, 1, 4 and 5 are grey, the eight others red.
    let (_, _, all) = contents(&write(&cube()));
    assert_eq!(seen[0], [&all[..6], &all[12..18]].concat());
    assert_eq!(seen[1], [&all[6..12], &all[18..]].concat());
    let color = &json["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"];
    let half = ((0.5 + 0.055) / 1.055_f64).powf(2.4);
    assert_eq!(color, &serde_json::json!([1.0, 0.0, half, 1.0]));
    // A material without a look in the file has no name.
    let names = [0, 1].map(|n| json["materials"][n]["name"].as_str().unwrap());
    assert_eq!(names, ["", "of the file"]);
    // A thousand colours do not become a thousand parts.
    let rainbow = (0..12).map(|n| paint(n, Some([n as f64 / 12.0, 0.0, 0.0]))).collect();
    let (json, _) = read(&write(&MeshAsset { paints: rainbow, ..cube() }));
    assert_eq!(json["materials"].as_array().unwrap().len(), 12);
    let ball = ball(24);
    let many = (0..ball.triangles.len()).map(|n| paint(n, Some([n as f64 / 1e4, 0.0, 0.0]))).collect();
    let (json, _) = read(&write(&MeshAsset { paints: many, ..ball }));
    assert_eq!(json["materials"].as_array().unwrap().len(), MAX_MATERIALS + 1);
}

/// Half of a cube has a picture, twice: the file has it once, with the texture coordinates of corners, and
/// the rest is complete.
#[test]
fn a_picture_is_in_the_file_once_and_corners_have_their_places_in_it() {
    let bytes: Arc<[u8]> = Arc::from(&b"seven b"[..]);
    let image =
        Image { sha256: Sha256::of(&bytes), kind: ImageKind::Jpeg, size: [1, 1], bytes: bytes.clone() };
    let image = Arc::new(image);
    let texture = |count: usize, at: f32| {
        let uvs = vec![[[at, 0.0], [at, 0.5], [1.0, at]]; count];
        Some(Texture { image: Arc::clone(&image), uvs })
    };
    let red = Some([1.0, 0.0, 0.0]);
    let paints = vec![
        Paint { texture: texture(2, 0.25), ..Paint::plain(2, None) },
        Paint { alpha: 0.5, texture: texture(4, 0.75), ..Paint::plain(4, red) },
        Paint::plain(8, None),
    ];
    let file = write(&MeshAsset { paints, ..cube() });
    let (json, binary) = read(&file);
    let materials = json["materials"].as_array().unwrap();
    assert_eq!(materials.len(), 3);
    let factor = |n: usize| materials[n]["pbrMetallicRoughness"]["baseColorFactor"].clone();
    assert_eq!(factor(1), serde_json::json!([1.0, 1.0, 1.0, 1.0]), "a picture without a colour is as it is");
    assert_eq!(factor(2), serde_json::json!([1.0, 0.0, 0.0, 0.5]));
    assert_eq!(
        (&materials[1]["alphaMode"], &materials[2]["alphaMode"]),
        (&serde_json::Value::Null, &"BLEND".into())
    );
    for n in [1, 2] {
        assert_eq!(materials[n]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
    }
    assert_eq!(json["images"].as_array().unwrap().len(), 1);
    assert_eq!(json["images"][0]["mimeType"], "image/jpeg");
    let part = |view: &serde_json::Value| {
        let view = &json["bufferViews"][view.as_u64().unwrap() as usize];
        let [offset, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        assert_eq!(offset % 4, 0);
        &binary[offset..offset + length]
    };
    assert_eq!(part(&json["images"][0]["bufferView"]), &*bytes);
    let primitives = json["meshes"][0]["primitives"].as_array().unwrap();
    let number = |bytes: &[u8], at: usize| f32::from_bits(word(bytes, 4 * at));
    let mut seen = Vec::new();
    for primitive in primitives {
        let accessor = |index: &serde_json::Value| &json["accessors"][index.as_u64().unwrap() as usize];
        let indices = accessor(&primitive["indices"]);
        let from = indices["byteOffset"].as_u64().unwrap() as usize / 4;
        let first = word(part(&indices["bufferView"]), 4 * from) as usize;
        let uvs = accessor(&primitive["attributes"]["TEXCOORD_0"]);
        assert_eq!((&uvs["type"], &uvs["count"]), (&"VEC2".into(), &accessor(&0.into())["count"]));
        let uvs = part(&uvs["bufferView"]);
        seen.push([number(uvs, 2 * first), number(uvs, 2 * first + 1)]);
    }
    // Corners without a picture come first, then those with a picture without a colour, then the other.
    assert_eq!(seen, [[0.0, 0.0], [0.25, 0.0], [0.75, 0.0]]);
}
