"""Who is here: beacons, presence, link quality."""
