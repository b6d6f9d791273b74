# A session over the CAN interface $1: looked at, set up, configured, armed, a 2 s insertion and
# its forces; then bad frames from somebody else, the fault, and clearing it.
session() {
    if=$1
    step $if-doctor-before cathforce --json doctor --link socketcan:$if
    step $if-up cathforce --json link up $if
    step $if-doctor cathforce --json doctor --link socketcan:$if
    # An independent witness: what the operator's side hears of the first ticks.
    candump -L -n 20 $if,180:7ff > /tmp/$if.log &
    step $if-run cathforce --json --quiet run --link socketcan:$if /bundle --cell 2 --out /tmp/$if.mcap
    step $if-witness cat /tmp/$if.log
    # ENCODER's identifier, whatever bytes, once HAPTIC says that the device is armed: before, it
    # would only refuse to arm.
    (candump -L $if,180:7ff | grep -q '#........04' && exec cangen $if -I 100 -L 8 -D r -g 1) &
    step $if-attacked cathforce --json --quiet run --link socketcan:$if /bundle --cell 2
    killall cangen
    step $if-fault cathforce --json fault list --link socketcan:$if
    step $if-clear cathforce fault clear BadFrames --link socketcan:$if
    step $if-after cathforce --json fault list --link socketcan:$if
}
