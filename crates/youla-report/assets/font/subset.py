"""Makes the three files of this folder from SourceSans3-Regular.ttf; needs fontTools and brotli."""

from fontTools import subset
from fontTools.ttLib import TTFont

SOURCE = "SourceSans3-Regular.ttf"
CHARACTERS = (
    "U+0020-007E,U+00A0-017F,U+018F,U+0218-021B,U+0259,U+02C6-02DD,U+0386-03CE,U+03D1,U+03D5,U+03D6,U+0400-045F,"
    "U+2002-200A,U+2010-2027,U+202F,U+2030,U+2032,U+2033,U+2039,U+203A,U+2044,U+2070-209C,U+20AC,U+2113,U+2122,U+2126,"
    "U+2153,U+2154,U+2190-2195,U+2202,U+2206,U+220F,U+2211,U+2212,U+2215,U+221A,U+221E,U+222B,U+2016,U+2248,U+2260,"
    "U+2264,U+2265,U+25A1,U+25CB,U+25CF,U+25CA"
)
# The licence reserves the name of the original for the original.
NAMES = {1: "Youla Figures", 3: "Youla Figures, from Source Sans 3.052", 4: "Youla Figures", 6: "YoulaFigures-Regular"}


def make(flavor, path):
    options = subset.Options()
    # Without kerning and ligatures the width of a text is the sum of the widths of its characters.
    options.layout_features = []
    options.drop_tables += ["GPOS", "GSUB", "GDEF", "DSIG", "BASE", "kern"]
    options.legacy_kern = False
    options.hinting = False
    options.glyph_names = False
    options.notdef_outline = True
    options.name_IDs = [0, 1, 2, 3, 4, 5, 6, 13, 14]
    options.name_languages = [0x409]
    options.flavor = flavor
    font = subset.load_font(SOURCE, options)
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=subset.parse_unicodes(CHARACTERS))
    subsetter.subset(font)
    for record in font["name"].names:
        if record.nameID in NAMES:
            record.string = NAMES[record.nameID]
    font["head"].modified = font["head"].created
    font.recalcTimestamp = False
    subset.save_font(font, path, options)


make("woff2", "figures.woff2")
make(None, "figures.ttf")

font = TTFont("figures.ttf")
widths = {code: font["hmtx"][glyph][0] for code, glyph in font.getBestCmap().items()}
with open("widths.txt", "w") as file:
    for code, width in sorted(widths.items()):
        print(f"{code:04x} {width}", file=file)
