//! The serial ports of this computer.

/// A serial port that an SLCAN adapter may be behind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SerialPort {
    /// As the operating system names it, e.g. `/dev/ttyACM0` or `COM3`.
    pub path: String,
    /// What its USB device says of itself; `None` of any other port.
    pub usb: Option<Usb>,
}

/// A USB device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Usb {
    pub vendor: u16,
    pub product: u16,
    pub manufacturer: Option<String>,
    pub name: Option<String>,
}

/// None: this program was built without serial ports.
#[cfg(not(feature = "hardware"))]
pub fn serial_ports() -> Vec<SerialPort> {
    Vec::new()
}

/// Every serial port, USB devices first, then by name; none where they cannot be listed.
#[cfg(feature = "hardware")]
pub fn serial_ports() -> Vec<SerialPort> {
    let ports = serialport::available_ports().unwrap_or_default().into_iter();
    let mut ports: Vec<_> = ports
        .map(|port| SerialPort {
            path: port.port_name,
            usb: match port.port_type {
                serialport::SerialPortType::UsbPort(usb) => Some(Usb {
                    vendor: usb.vid,
                    product: usb.pid,
                    manufacturer: usb.manufacturer,
                    name: usb.product,
                }),
                _ => None,
            },
        })
        .collect();
    ports.sort_by(|a, b| (a.usb.is_none(), &a.path).cmp(&(b.usb.is_none(), &b.path)));
    ports
}
