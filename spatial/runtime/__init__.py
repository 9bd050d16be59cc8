"""What the process itself needs: memory given back to the system, and temporary storage that grows with time."""
