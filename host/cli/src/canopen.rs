//! Identifiers that CANopen's predefined connection set gives to the nodes of a bus.
//!
//! Source: CiA 301, "predefined connection set". A drive with such frames also listens to its RPDOs and
//! its SDO server on the same bus, where our frames of the same identifiers would command it.

use cathforce_bus::Id;

/// Nodes of a bus.
pub const LAST_NODE: u32 = 127;
/// The first identifiers of the objects of nodes, less the node's number, and whether the drive listens.
const OBJECTS: [(u32, &str, bool); 12] = [
    (0x080, "EMCY", false),
    (0x180, "TPDO1", false),
    (0x200, "RPDO1", true),
    (0x280, "TPDO2", false),
    (0x300, "RPDO2", true),
    (0x380, "TPDO3", false),
    (0x400, "RPDO3", true),
    (0x480, "TPDO4", false),
    (0x500, "RPDO4", true),
    (0x580, "SDO answer", false),
    (0x600, "SDO request", true),
    (0x700, "heartbeat", false),
];

/// The object of an identifier, and its node.
pub fn object(id: u32) -> Option<(&'static str, u32)> {
    OBJECTS.iter().find_map(|&(base, name, _)| {
        let node = id.checked_sub(base)?;
        (1..=LAST_NODE).contains(&node).then_some((name, node))
    })
}

/// Frames of ours that a node with default identifiers sends too or listens to: each with the node's
/// object and our name.
pub fn collisions(node: u32) -> Vec<String> {
    let of = |&(base, name, listens): &(u32, &'static str, bool)| {
        let id = base + node;
        let ours = Id::from_raw(id)?;
        let effect = if listens { ", which would command the drive" } else { "" };
        Some(format!("{id:#05x} is its {name} and our {ours:?}{effect}"))
    };
    OBJECTS.iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drive_of_node_one_collides_with_our_shapes_and_forces() {
        assert_eq!(object(0x181), Some(("TPDO1", 1)));
        assert_eq!(object(0x27F), Some(("RPDO1", 127)));
        assert_eq!((object(0x180), object(0x000)), (None, None));
        let found = collisions(1).join("\n");
        for says in [
            "0x201 is its RPDO1 and our Shape(1), which would command the drive",
            "0x281 is its TPDO2 and our Force(1)",
        ] {
            assert!(found.contains(says), "{says}: {found}");
        }
    }
}
