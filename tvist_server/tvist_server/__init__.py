"""Everything around a controller: clock, gateways, recordings and processes."""
