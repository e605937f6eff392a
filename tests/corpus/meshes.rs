//! The mesh files of the cases, made here: none is third-party.

/// Returns a file by its name in the cases.
pub(crate) fn made(what: &str) -> Vec<u8> {
    match what {
        "tetrahedron" => binary(b"made here", &TETRAHEDRON),
        "solid tetrahedron" => binary(b"solid made by a CAD program", &TETRAHEDRON),
        "cut tetrahedron" => {
            let mut file = binary(b"made here", &TETRAHEDRON);
            file.truncate(file.len() - 7);
            file
        }
        "no triangles" => binary(b"made here", &[]),
        "351000 triangles" => strewn(351_000),
        "claims" => {
            let mut file = binary(b"made here", &TETRAHEDRON);
            file[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
            file
        }
        "more than it says" => {
            let mut file = binary(b"made here", &TETRAHEDRON);
            file[80..84].copy_from_slice(&3_u32.to_le_bytes());
            file
        }
        "ascii triangle" => "solid made here\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
            vertex 0 1 0\nendloop\nendfacet\nendsolid made here\n"
            .into(),
        "obj triangle" => "mtllib ../../../etc/passwd\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n".into(),
        "picture" => {
            std::fs::read(simd_tests::robots::assets().join("textured/pictures/squares.png")).unwrap()
        }
        "manifest" => "<package><name>pack</name></package>\n".into(),
        "rubbish" => "rubbish".into(),
        other => panic!("no such file: {other}"),
    }
}

type Triangle = [[f32; 3]; 3];

const TETRAHEDRON: [Triangle; 4] = {
    let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    [[o, y, x], [o, x, z], [o, z, y], [x, y, z]]
};

/// Returns a binary STL.
fn binary(header: &[u8], triangles: &[Triangle]) -> Vec<u8> {
    let mut file = header.to_vec();
    file.resize(80, b' ');
    file.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        file.extend([0; 12]);
        file.extend(triangle.iter().flatten().flat_map(|number| number.to_le_bytes()));
        file.extend([0; 2]);
    }
    file
}

/// Returns a binary STL of this many triangles, no two of which share a corner.
pub(crate) fn strewn(triangles: usize) -> Vec<u8> {
    let at = |index: usize| {
        let x = index as f32;
        [[x, 0.0, 0.0], [x + 0.5, 0.0, 0.0], [x, 0.5, 1.0]]
    };
    binary(b"made here", &(0..triangles).map(at).collect::<Vec<_>>())
}
