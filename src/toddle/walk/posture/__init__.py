"""Centre of mass, soles, waist and chest become joint angles (Huber 2019, section 2.1.4)."""
