set encoding utf8
set terminal pngcairo noenhanced size 1500,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'rates-failures.png'
set datafile separator comma
set title 'Races lost, by kind: rates'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'why'
set xrange [-0.6:7.6]
set xtics ('target gate''s frame' 0, 'other object' 1, 'left the course' 2, 'passed beside' 3, 'wrong gate' 4, 'timeout' 5, 'lost control' 6, 'lost server' 7)
set ylabel 'share of the races flown [%]'
set yrange [0:*]
set boxwidth 0.368
set style fill solid 0.85 noborder
plot 'rates-failures.csv' skip 1 every ::0::7 using ($2+-0.2):3 with boxes lc rgb '#0072b2' title 'body rates, position 0.3 m, 14 m/s', \
     'rates-failures.csv' skip 1 every ::8::15 using ($2+0.2):3 with boxes lc rgb '#d55e00' title 'rotor thrusts, position 0.3 m, 14 m/s'
