"""Steps of bodies without joints in which vibrations are exact, so that only what drives them bounds their size."""
