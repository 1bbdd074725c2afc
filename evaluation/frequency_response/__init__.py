"""The objective motion cueing test of ICAO 9625: modulus and phase of a policy."""
