//! Small meshes as text in, solids or faults out.

use std::fs;
use std::path::PathBuf;

use super::load;

/// A unit cube as OBJ, with polygons.
const CUBE_OBJ: &str = "# a cube\nmtllib none.mtl\no cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\n\
    v 1 1 1\nv 0 1 1\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n";
/// Corners of the cube's triangles, as `CUBE_OBJ` numbers them.
const TRIANGLES: [[usize; 3]; 12] = [
    [4, 3, 2],
    [4, 2, 1],
    [5, 6, 7],
    [5, 7, 8],
    [1, 2, 6],
    [1, 6, 5],
    [3, 4, 8],
    [3, 8, 7],
    [1, 5, 8],
    [1, 8, 4],
    [2, 3, 7],
    [2, 7, 6],
];

fn corner(number: usize) -> [f32; 3] {
    let text = CUBE_OBJ
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .nth(number - 1)
        .unwrap();
    let numbers: Vec<f32> = text
        .split(' ')
        .map(|number| number.parse().unwrap())
        .collect();
    numbers.try_into().unwrap()
}

/// A folder of this test's own, gone with it.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("tsukamu-mesh-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, bytes).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn binary_stl() -> Vec<u8> {
    let mut bytes = vec![0_u8; 80];
    bytes.extend((TRIANGLES.len() as u32).to_le_bytes());
    for triangle in TRIANGLES {
        bytes.extend([0_u8; 12]);
        triangle
            .into_iter()
            .flat_map(corner)
            .for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0_u8; 2]);
    }
    bytes
}

fn text_stl() -> String {
    let vertex = |number| corner(number).map(|x| x.to_string()).join(" ");
    let facet = |t: [usize; 3]| {
        let [a, b, c] = t.map(vertex);
        format!(
            "facet normal 0 0 0\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n"
        )
    };
    format!(
        "solid cube\n{}endsolid cube\n",
        TRIANGLES.map(facet).concat()
    )
}

/// The cube's numbers as a glTF keeps them: 8 positions, 36 indices.
fn gltf_buffer() -> Vec<u8> {
    let positions = (1..=8).flat_map(corner).flat_map(f32::to_le_bytes);
    let indices = TRIANGLES
        .into_iter()
        .flatten()
        .flat_map(|corner| (corner as u16 - 1).to_le_bytes());
    positions.chain(indices).collect()
}

/// A glTF with this buffer URI and this node transform.
fn gltf_text(uri: &str, transform: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"children":[1],"scale":[2,2,2]}},{{"mesh":0{transform}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "buffers":[{{"byteLength":168{uri}}}],
        "bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":96}},{{"buffer":0,"byteOffset":96,"byteLength":72}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},
                     {{"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}}]}}"#
    )
}

fn glb(json: &str, buffer: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + json.len() + 8 + buffer.len();
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((length as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json.as_slice()), (b"BIN\0", buffer)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

fn data_uri(bytes: &[u8]) -> String {
    use base64::Engine;
    let text = base64::engine::general_purpose::STANDARD.encode(bytes);
    format!(r#","uri":"data:application/octet-stream;base64,{text}""#)
}

#[test]
fn every_format_gives_the_same_cube() {
    let folder = Folder::new("formats");
    folder.write("a cube.bin", gltf_buffer());
    let mirrored = r#","scale":[-1,1,1]"#;
    for (name, bytes, volume) in [
        ("c.obj", CUBE_OBJ.as_bytes().to_vec(), 1.0),
        ("b.stl", binary_stl(), 1.0),
        ("t.STL", text_stl().into_bytes(), 1.0),
        (
            "u.gltf",
            gltf_text(&data_uri(&gltf_buffer()), "").into_bytes(),
            8.0,
        ),
        (
            "f.gltf",
            gltf_text(r#","uri":"a%20cube.bin""#, "").into_bytes(),
            8.0,
        ),
        (
            "m.gltf",
            gltf_text(&data_uri(&gltf_buffer()), mirrored).into_bytes(),
            8.0,
        ),
        ("b.glb", glb(&gltf_text("", ""), &gltf_buffer()), 8.0),
    ] {
        let solid = load(&folder.write(name, bytes), 0.1).unwrap_or_else(|fault| panic!("{fault}"));
        let counts = (
            solid.vertices().len(),
            solid.faces().len(),
            solid.edges().len(),
        );
        assert_eq!(counts, (8, 6, 12), "{name}");
        assert!(
            (solid.volume() - volume * 1.0e-3).abs() < 1.0e-9,
            "{name}: {}",
            solid.volume()
        );
    }
}

/// Asserts that this file is refused, by name and with these words.
fn check_refused(folder: &Folder, name: &str, text: &str, expected: &str) {
    let fault = load(&folder.write(name, text), 1.0).err();
    let fault = fault.map(|fault| fault.to_string()).unwrap_or_default();
    assert!(
        fault.contains(name) && fault.contains(expected),
        "{fault:?} lacks {expected:?}"
    );
}

#[test]
fn what_is_no_solid_is_refused_with_file_fault_and_place() {
    let folder = Folder::new("faults");
    let cube = |from: &str, to: &str| CUBE_OBJ.replace(from, to);
    let flat = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\n".to_owned();
    for (name, text, expected) in [
        ("open.obj", cube("f 2 3 7 6\n", ""), "belongs to face"),
        (
            "turned.obj",
            cube("f 2 3 7 6", "f 6 7 3 2"),
            "oriented against each other",
        ),
        ("flat.obj", flat, "encloses no volume"),
        (
            "beyond.obj",
            cube("f 2 3 7 6", "f 2 3 7 99"),
            "at or before line 17: ",
        ),
        (
            "word.obj",
            cube("v 1 0 0", "v 1 zero 0"),
            "at or before line 5: position parse",
        ),
        ("none.obj", String::new(), "has no faces"),
        ("nan.obj", cube("v 1 1 1", "v nan 1 1"), "not finite"),
        (
            "x.ply",
            cube("", ""),
            "meshes are .obj, .stl, .gltf or .glb",
        ),
        (
            "cut.stl",
            text_stl().replace("vertex 1 1 1\n", ""),
            "triangle 2",
        ),
    ] {
        check_refused(&folder, name, &text, expected);
    }
    let fault = load(&folder.0.join("absent.obj"), 1.0)
        .unwrap_err()
        .to_string();
    assert!(fault.contains("absent.obj: cannot be read"), "{fault}");
}

#[test]
fn buffers_and_nodes_of_a_gltf_are_checked() {
    let folder = Folder::new("gltf");
    let uri = |uri: &str| gltf_text(&format!(r#","uri":"{uri}""#), "");
    let ring = gltf_text(&data_uri(&gltf_buffer()), r#","children":[0]"#);
    for (name, text, expected) in [
        (
            "up.gltf",
            uri("../a.bin"),
            "is not a file in the mesh's folder",
        ),
        (
            "web.gltf",
            uri("http://a/b"),
            "is not a file in the mesh's folder",
        ),
        (
            "gone.gltf",
            uri("gone.bin"),
            "buffer 0: gone.bin: cannot be read",
        ),
        (
            "short.gltf",
            gltf_text(&data_uri(&[0; 20]), ""),
            "it has 20 bytes and should have 168",
        ),
        ("ring.gltf", ring, "nodes form a ring"),
        ("not.gltf", "hello".to_owned(), "document"),
    ] {
        check_refused(&folder, name, &text, expected);
    }
}

#[test]
fn damaged_files_are_refused_without_a_panic() {
    let folder = Folder::new("damage");
    let files = [
        ("d.obj", CUBE_OBJ.as_bytes().to_vec()),
        ("d.stl", binary_stl()),
        ("t.stl", text_stl().into_bytes()),
        (
            "d.gltf",
            gltf_text(&data_uri(&gltf_buffer()), "").into_bytes(),
        ),
        ("d.glb", glb(&gltf_text("", ""), &gltf_buffer())),
    ];
    for (name, bytes) in files {
        for cut in (0..bytes.len()).step_by(3) {
            // The answer may be a solid (a cut comment, say); only a panic is wrong.
            let _ = load(&folder.write(name, &bytes[..cut]), 1.0);
            let mut changed = bytes.clone();
            changed[cut] = changed[cut].wrapping_mul(31).wrapping_add(cut as u8);
            let _ = load(&folder.write(name, &changed), 1.0);
        }
    }
}
