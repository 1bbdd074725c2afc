"""Import of logs of real cars: columns, timing, mounting."""
