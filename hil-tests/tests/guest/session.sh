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

# A device that runs free on the virtual bus $1: what is recorded of it, and what a witness hears.
# Both stand aside for the host: elsewhere a device has a processor of its own.
free() {
    if=$1
    cathforce link up $if > /dev/null
    cathforce --quiet link serve socketcan:$if &
    device=$!
    candump -L $if > /tmp/$if.log &
    witness=$!
    renice -n 19 -p $device $witness > /dev/null
    step $if-free cathforce --json --quiet run --free --link socketcan:$if /bundle --cell 2 --duration 1 --out /tmp/$if.mcap
    kill $witness $device
    cathforce export /tmp/$if.mcap --candump /tmp/$if-recorded.log > /dev/null
    step $if-latency cathforce --json latency /tmp/$if.mcap
    step $if-check cathforce --json check --no-replay /tmp/$if.mcap
    step $if-heard cut -d ' ' -f 3 /tmp/$if.log
    step $if-recorded cut -d ' ' -f 3 /tmp/$if-recorded.log
}
