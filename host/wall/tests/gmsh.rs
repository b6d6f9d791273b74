//! Meshes of Gmsh in both versions, and what is wrong with the others.

use std::path::PathBuf;

use cathforce_wall::{WallMesh, read_gmsh};

/// One tetrahedron whose side x = 0 is touched and whose side z = 0 is held, as version 2.2.
fn old() -> String {
    let mut text = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n");
    text +=
        "$PhysicalNames\n3\n2 1 \"inner\"\n2 2 \"fixed\"\n3 3 \"the wall\"\n$EndPhysicalNames\n";
    text += "$Nodes\n5\n7 9 9 9\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n";
    text += "$Elements\n4\n1 15 2 0 1 7\n2 2 2 1 1 1 3 4\n3 2 2 2 2 1 2 3\n4 4 2 3 1 1 2 3 4\n$EndElements\n";
    text
}

/// The same as version 4.1.
fn new() -> String {
    let mut text = String::from("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n");
    text += "$PhysicalNames\n2\n2 1 \"inner\"\n2 2 \"fixed\"\n$EndPhysicalNames\n";
    text += "$Entities\n1 0 2 1\n1 0 0 0 0\n";
    text += "5 0 0 0 0 1 1 1 1 0\n6 0 0 0 1 1 0 1 2 0\n1 0 0 0 1 1 1 0 2 5 -6\n$EndEntities\n";
    text += "$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n";
    text += "$Elements\n3 3 1 3\n2 5 2 1\n1 1 3 4\n2 6 2 1\n2 1 2 3\n3 1 4 1\n3 1 2 3 4\n$EndElements\n";
    text
}

fn read(text: &str) -> Result<WallMesh, String> {
    let folder = tempfile::tempdir().unwrap();
    let file: PathBuf = folder.path().join("wall.msh");
    std::fs::write(&file, text).unwrap();
    read_gmsh(&file).map_err(|error| error.to_string())
}

#[test]
fn both_versions_are_the_same_wall() {
    for text in [old(), new()] {
        let mesh = read(&text).unwrap();
        assert_eq!((mesh.corners, mesh.nodes_mm.len(), mesh.tetrahedra.len()), (4, 10, 1));
        assert!((mesh.volume_mm3() - 1.0 / 6.0).abs() < 1e-12);
        // Three corners and three middles of the side z = 0.
        assert_eq!(mesh.fixed.len(), 6);
        assert!(mesh.fixed.iter().all(|node| mesh.nodes_mm[*node as usize].z == 0.0));
        let [a, b, c] = [0, 1, 2].map(|k| mesh.nodes_mm[mesh.inner[0][k] as usize]);
        assert!((b - a).cross(&(c - a)).x < 0.0, "the normal points out of the material");
    }
}

#[test]
fn other_files_are_refused_with_line_cause_and_fix() {
    for (text, words) in [
        ("solid vessel\n".to_owned(), "wall.msh:1: this is no mesh of Gmsh"),
        (old().replace("2.2 0 8", "1.0 0 8"), "wall.msh:2: version 1.0"),
        (old().replace("2.2 0 8", "2.2 1 8"), "wall.msh:2: the mesh is binary"),
        (
            old().replace("\"inner\"", "\"lumen\""),
            "no triangle belongs to a physical surface `inner`",
        ),
        (old().replace("1 3 4\n", "1 3 8\n"), "wall.msh:21: node 8 is not in the file"),
        (old().replace("3 0 1 0", "3 0 one 0"), "`one` is not a finite number"),
        (new().replace("3 1 2 3 4\n$EndElements\n", "3 1 2"), "ends too early"),
        (old().replace("4 4 2 3 1", "4 7 2 3 1"), "`$EndElements` is not a whole number"),
    ] {
        let error = read(&text).unwrap_err();
        assert!(error.contains(words) && error.contains("fix: "), "`{words}` in: {error}");
    }
}
