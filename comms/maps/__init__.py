"""What a robot knows of all maps: snapshots, staging of half-arrived ones, the store, signatures."""
