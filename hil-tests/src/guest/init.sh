#!/bin/busybox sh
# First program of the guest: mounts what Linux needs, loads CAN, runs the script, powers off.
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
# Whatever comes late must not land among the answers.
echo 1 > /proc/sys/kernel/printk
for module in can can-raw can-dev vcan slcan sja1000 kvaser_pci; do
    insmod /modules/$module.ko || echo "@@ no module $module"
done

# Runs a command and says what became of it.
step() {
    name=$1
    shift
    "$@" > /tmp/out 2> /tmp/err
    status=$?
    echo "@@ step $name $status $(cut -d' ' -f1 /proc/uptime)"
    sed 's/^/@1 /' /tmp/out
    sed 's/^/@2 /' /tmp/err
}

cd /tmp
. /script.sh
echo "@@ end"
poweroff -f
