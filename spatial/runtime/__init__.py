"""What the process itself needs: threads, memory given back to the system, temporary storage that grows with time."""
